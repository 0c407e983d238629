// Drag in the world against closed forms (P10), and how it behaves where it is stiff.
#include <catch2/catch.hpp>

#include "tests/physics/schemes.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

constexpr double kTerminal = 20;  // m/s
constexpr double kQuadratic = kGravity / (kTerminal * kTerminal);

BodyState fall(const Drag& drag, double time_s, const Vec3& v_WBcm = {}) {
  World world(settings());
  const BodyId body = add(world, ball(0.1, {}, v_WBcm));
  REQUIRE(world.set_drag(body, drag).result == Result::ok);
  steps(world, static_cast<int>(60 * time_s));
  return state(world, body);
}

}  // namespace

TEST_CASE("P10: drag brings a falling body to its terminal velocity") {
  // Quadratic: v = vt tanh(g t / vt), y = vt^2 / g ln cosh(g t / vt).
  const double s = kGravity * 3 / kTerminal;
  const BodyState quadratic = fall({0, kQuadratic, 0}, 3);
  CHECK(quadratic.v_WBcm.z == Approx(-17.997264).epsilon(1e-7));
  CHECK(quadratic.p_WBo.z == Approx(-33.831523).epsilon(1e-7));
  CHECK(std::abs(quadratic.v_WBcm.z + kTerminal * std::tanh(s)) < 1e-11);
  CHECK(std::abs(quadratic.p_WBo.z + std::log(std::cosh(s)) / kQuadratic) < 1e-11);
  // Linear: v = vt (1 - e^(-g t / vt)), y = vt t - vt v / g.
  const BodyState linear = fall({kGravity / kTerminal, 0, 0}, 3);
  const double v = kTerminal * (1 - std::exp(-s));
  CHECK(std::abs(linear.v_WBcm.z + v) < 1e-12);
  CHECK(std::abs(linear.p_WBo.z + kTerminal * 3 - kTerminal * v / kGravity) < 1e-11);
}

TEST_CASE("drag: thrown straight up, over the apex, where |v| v has a kink") {
  // Up: atan(v0 / vt) vt / g long, vt^2 / 2g ln(1 + v0^2 / vt^2) high; down as P10.
  constexpr double v0 = 15;
  const BodyState end = fall({0, kQuadratic, 0}, 3, {0, 0, v0});
  const double up_s = kTerminal / kGravity * std::atan(v0 / kTerminal);
  const double height = std::log(1 + v0 * v0 / (kTerminal * kTerminal)) / (2 * kQuadratic);
  const double s = kGravity * (3 - up_s) / kTerminal;
  CHECK(std::abs(end.v_WBcm.z + kTerminal * std::tanh(s)) < 1e-10);
  CHECK(std::abs(end.p_WBo.z - height + std::log(std::cosh(s)) / kQuadratic) < 1e-10);
}

TEST_CASE("drag: however strong, it ends at the terminal velocity and never beyond rest") {
  for (const double factor : {1e3, 1e6, 1e12}) {
    CAPTURE(factor);
    const BodyState linear = fall({kGravity * factor, 0, 0}, 1, {1e3, 0, 0});
    CHECK(linear.v_WBcm.z == Approx(-1 / factor).epsilon(1e-12));
    CHECK(std::abs(linear.v_WBcm.x) < 1e-12);
    const BodyState quadratic = fall({0, kGravity * factor, 0}, 1, {1e3, 0, 0});
    CHECK(quadratic.v_WBcm.z == Approx(-1 / std::sqrt(factor)).epsilon(1e-6));
    CHECK(quadratic.v_WBcm.x >= 0);
    CHECK(quadratic.v_WBcm.x < 1e-6);
    CHECK(quadratic.p_WBo.x < 1);
  }
}

TEST_CASE("drag: angular drag stops a spin by its exponential") {
  for (const double strength : {0.05, 5.0, 1e9}) {
    World world(weightless());
    BodySpec spec = ball(0.5, {});  // J = 0.1
    spec.w_WB = {0, 3, 0};
    const BodyId body = add(world, spec);
    REQUIRE(world.set_drag(body, {0, 0, strength}).result == Result::ok);
    steps(world, 6);
    const double w = 3 * std::exp(-0.1 * strength / 0.1);
    CHECK(state(world, body).w_WB.y == Approx(w).epsilon(1e-9).margin(1e-12));
  }
}

TEST_CASE("drag: a box that slides without friction slows down by its exponential") {
  World world(settings());
  add(world, ground(0));
  const BodyId box = add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0.5}, {3, 0, 0}));
  REQUIRE(world.set_drag(box, {0.7, 0, 0}).result == Result::ok);
  steps(world, 60);
  CHECK(state(world, box).in_contact);
  CHECK(state(world, box).v_WBcm.x == Approx(3 * std::exp(-0.7)).epsilon(1e-3));
  // However strong, it does not push back.
  REQUIRE(world.set_drag(box, {1e12, 1e12, 1e12}).result == Result::ok);
  steps(world, 60);
  CHECK(norm(state(world, box).v_WBcm) < 1e-3);
}

TEST_CASE("drag: angular drag of any strength leaves the turn of its exponential") {
  // About a principal axis: w = w0 e^(-c t / J), turned by w0 J / c (1 - e^(-c t / J)). Beside it a
  // tumbling body, by many short ticks.
  const Inertia inertia{1, {1, 2, 3}};
  for (const double c : {1.0, 100.0, 8000.0, 8800.0, 1e5, 1e7}) {
    CAPTURE(c);
    FlightLoads loads;
    loads.drag.angular = c;
    Flight body;
    body.w = {0, 0, 200};
    const Flight end = run(*find_scheme("exact"), body, inertia, loads, 1.0 / 60, 1);
    const double decay = c / 3 / 60, turn = 600 / c * -std::expm1(-decay);
    CHECK(angle(end.q, Rotation(std::cos(turn / 2), 0, 0, std::sin(turn / 2))) < 1e-12);
    CHECK(std::abs(end.w.z() - 200 * std::exp(-decay)) < 1e-11);
    body.w = {100, 300, 200};
    const Flight once = run(*find_scheme("exact"), body, inertia, loads, 1.0 / 60, 1);
    const Flight often = run(*find_scheme("exact"), body, inertia, loads, 1.0 / 60, 64);
    CHECK(angle(once.q, often.q) < 1e-9);
  }
}

TEST_CASE("drag and springs hold bodies that their loads alone would throw beyond all limits") {
  // A speck of 1 mg: 1 kg/s of drag lets 100 N drive it at 100 m/s, a spring of 1e6 N/m at 0.1 mm.
  World world(weightless());
  BodySpec speck;
  speck.mass_kg = 1e-6;
  const BodyId dragged = add(world, speck);
  speck.p_WBo = {10, 0, 0};
  const BodyId sprung = add(world, speck);
  REQUIRE(world.set_drag(dragged, {1, 0, 0}).result == Result::ok);
  Spring spring;
  spring.a = sprung;
  spring.point_b = {10, 0, 0};
  spring.stiffness = 1e6;
  spring.damping = 10;
  REQUIRE(world.add_springs(std::array{spring}).result == Result::ok);
  for (const BodyId body : {dragged, sprung}) {
    Wrench push;
    push.body = body;
    push.value = {100, 0, 0};
    push.duration = WrenchDuration::until_cleared;
    REQUIRE(world.push(std::array{push}).result == Result::ok);
  }
  steps(world, 60);
  CHECK(world.quarantined_count() == 0);
  CHECK(state(world, dragged).v_WBcm.x == Approx(100).epsilon(1e-12));
  CHECK(state(world, sprung).p_WBo.x - 10 == Approx(1e-4).epsilon(1e-6));
}

}  // namespace cradle
