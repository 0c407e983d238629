// Hard cases of friction on one contact and on several points.
#include <catch2/catch.hpp>
#include <numbers>
#include <vector>

#include "server/dynamics/contact/single_contacts.h"
#include "tests/physics/standing.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

/// Three feet on a circle.
Standing pizza_saver(double mass_kg, double R_m, double mu, double torque_Nm) {
  Standing saver;
  const double J = mass_kg * R_m * R_m / 2;
  saver.set_mass(mass_kg, {J, J, J});
  saver.x[1].z() = 0;
  saver.feet.clear();
  for (int k = 0; k < 3; ++k) {
    const double a = 2 * std::numbers::pi * k / 3;
    saver.feet.emplace_back(R_m * std::cos(a), R_m * std::sin(a), 0);
  }
  saver.friction = mu;
  saver.acceleration[1] = {0, 0, -10};
  saver.torque[1] = {0, 0, torque_Nm};
  return saver;
}

}  // namespace

TEST_CASE("P33: one contact is solved as its equations say") {
  // Drake's pgs_solver_test: W = diag(12, 4, 3), v* = (-1, -1, -1). With mu = 1000 the impulse is
  // (1/12, 1/4, 1/3) and nothing moves; with mu = 0 it is (0, 0, 1/3), and v = (-1, -1, 0). 1e-14.
  for (const double mu : {0.0, 1000.0}) {
    CAPTURE(mu);
    Standing body;
    body.set_mass(1.0 / 3, {1, 1.0 / 9, 1});  // one foot 1 m below: W = 3 + diag(9, 1, 0)
    body.v[1] = {-1, -1, -1};
    body.friction = mu;
    body.touch();
    find_effective_masses(body.contact[0]);
    BodyLines lines;
    lines.begin(body.tick(), body.arrays(), body.inverse_inertia_W);
    SingleContact contact(body.contact[0], lines);
    const ConstraintPoint& p = body.contact[0].points[0];
    const SubStep step{0.01, 100, 0, 0, {}};
    contact.relax(step);
    // A sweep works along the tangents with the larger response, 12: the other one has done a third
    // of its way, and two thirds of what is left at each sweep more.
    const Vector once(mu > 0 ? 0 : -1, mu > 0 ? -2.0 / 3 : -1, 0);
    CHECK((contact.relative_velocity(p) - once).norm() < 1e-14);
    for (int sweep = 0; sweep < 90; ++sweep) contact.relax(step);
    const ContactConstraint& c = body.contact[0];
    const PointImpulse& own = c.impulses[0];
    const Vector impulse = own.lambda * c.n + own.lambda_t.x() * c.t1 + own.lambda_t.y() * c.t2();
    const Vector expected = mu > 0 ? Vector(1.0 / 12, 0.25, 1.0 / 3) : Vector(0, 0, 1.0 / 3);
    CHECK((impulse - expected).norm() < 1e-14);
    const Vector v = mu > 0 ? Vector(0, 0, 0) : Vector(-1, -1, 0);
    CHECK((contact.relative_velocity(p) - v).norm() < 1e-14);
  }
}

TEST_CASE("P34: three points hold a torque, or give way to what is beyond them") {
  // Drake's pizza saver: m = 3 kg, R = 1.5 m, mu = 2/3, g = 10 m/s^2, dt = 0.01 s: of 20 Nm, below
  // mu m g R = 30, each point has 20 / 3R by friction and m g / 3 along the normal. m = 1, R = 1,
  // mu = 0.5: 3 Nm are held, of 6 one is left, which turns it. 1e-8.
  // Points also squeeze each other by 7.5e-6 of their force, which moves nothing, and is no fault:
  // six frictions against three equations.
  const auto solver = make_contact_solver("soft");
  struct Errors {
    double normal = 0, along = 0, radial = 0;  // relative
  };
  for (const auto& [m, R, mu, torque] :
       {std::tuple{3.0, 1.5, 2.0 / 3, 20.0}, std::tuple{1.0, 1.0, 0.5, 3.0}}) {
    CAPTURE(m);
    Standing saver = pizza_saver(m, R, mu, torque);
    const auto errors = [&, weight = m * 10 / 3, force = torque / (3 * R)] {
      Errors e;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector out = (saver.q[1] * saver.feet[k]).normalized();
        const Vector f = saver.force(k);
        e.normal = std::fmax(e.normal, std::abs(f.z() / weight - 1));
        e.along = std::fmax(e.along, std::abs(f.dot(Vector::UnitZ().cross(out)) / force + 1));
        e.radial = std::fmax(e.radial, std::abs(f.dot(out)) / f.norm());
      }
      return e;
    };
    saver.step(*solver);
    CHECK(saver.w[1].norm() < 1e-8);
    CHECK(errors().along < 1e-8);
    CHECK(errors().normal < 1e-8);
    const Rotation then = saver.q[1];
    for (int tick = 0; tick < 200; ++tick) saver.step(*solver);
    CHECK(saver.w[1].norm() < 1e-8);
    CHECK(angle(to_plain(saver.q[1]), {}) < 2e-5);  // in the first sub-step, and no farther:
    CHECK((saver.q[1].coeffs() - then.coeffs()).norm() < 1e-12);
    CHECK(errors().along < 1e-8);
    CHECK(errors().normal < 1e-8);
    CHECK(errors().radial < 1e-5);
  }
  Standing saver = pizza_saver(1, 1, 0.5, 0);
  for (int tick = 0; tick < 200; ++tick) saver.step(*solver);
  saver.torque[1] = {0, 0, 6};
  // Each tick 1 Nm is left. Friction begins late by a part of a sub-step: 0.6 % of the first tick.
  const double gain = (6.0 - 5.0) / 0.5 * 0.01;
  saver.step(*solver);
  CHECK(saver.w[1].z() == Approx(gain).epsilon(7e-3));
  for (int tick = 2; tick <= 20; ++tick) saver.step(*solver);
  const double then = saver.w[1].z();
  for (int tick = 1; tick <= 100; ++tick) {
    saver.step(*solver);
    CAPTURE(tick);
    CHECK(saver.w[1].z() - then == Approx(gain * tick).epsilon(1e-8));
  }
}

TEST_CASE("P39: a box that spins on its corners is slowed by their friction") {
  // Jolt's TestAngularFriction: 2 m wide, mu = sqrt(0.06), 10 rad/s, 1 s: slowed by
  // mu g sqrt(2) m / J, within 5e-3 rad/s and 2e-3 rad.
  const double mu = std::sqrt(0.06), slowing = mu * kGravity * std::sqrt(2.0) * 1.5;
  World world(settings());
  add(world, ground(mu));
  BodySpec spec = brick({1, 1, 1}, {0, 0, 1});
  spec.material.friction = mu;
  spec.w_WB = {0, 0, 10};
  const BodyId body = add(world, spec);
  steps(world, 60);
  const BodyState s = state(world, body);
  CHECK(s.w_WB.z == Approx(10 - slowing).margin(5e-3));
  const double turn = 10 - slowing / 2;
  CHECK(angle(s.q_WB, {std::cos(turn / 2), 0, 0, std::sin(turn / 2)}) < 2e-3);
  CHECK(std::hypot(s.p_WBo.x, s.p_WBo.y) < 1e-3);
}

}  // namespace cradle
