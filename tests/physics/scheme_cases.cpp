// Cases P06 to P09, P41 and P42, with every scheme, or with the tolerances of exact.
#include <catch2/catch.hpp>

#include "tests/physics/schemes.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

/// The next time at which the body's own w_y vanishes, by halving the step in which it does.
double next_flip(const Scheme& scheme, Flight& body, double& time_s, double h) {
  const auto spin = [](const Flight& at) { return (at.q.conjugate() * at.w).y(); };
  Work work;
  constexpr double kGivenUp_s = 100;
  while (time_s < kGivenUp_s) {
    const Flight start = body;
    scheme.advance(body, kBox, {}, h, work);
    time_s += h;
    if (spin(start) * spin(body) >= 0) continue;
    double early = 0, late = h;
    while (late - early > 1e-12) {
      Flight middle = start;
      scheme.advance(middle, kBox, {}, (early + late) / 2, work);
      (spin(start) * spin(middle) < 0 ? late : early) = (early + late) / 2;
    }
    return time_s - h + early;
  }
  return kGivenUp_s;
}

}  // namespace

TEST_CASE("P06: an axisymmetric body precesses as Kane's closed form says") {
  // I = .04 across, J = .02 along z; body rate (I - J) / I wz = 3 rad/s, |L| / I = 5.385165 rad/s:
  // q(t) = exp(t L / I) q(0) exp(3 t z). Kane, Likins, Levinson 1983, "Spacecraft Dynamics".
  World world(settings());
  BodySpec spec;
  spec.mass_kg = 1;
  spec.inertia_kgm2 = {0.04, 0.04, 0.02};
  spec.p_WBo = {1, 2, 3};
  spec.v_WBcm = {-4.2, 5.5, 6.1};
  spec.w_WB = {2, 4, 6};
  const BodyId body = add(world, spec);
  const Vector precession(2, 4, 3);  // L / I
  CHECK(precession.norm() == Approx(5.385164807));
  double worst_m = 0, worst_rad = 0;
  for (int tick = 1; tick <= 600; ++tick) {
    world.step();
    const double t = tick / 60.0;
    const BodyState s = state(world, body);
    const Eigen::AngleAxisd in_space(precession.norm() * t, precession.normalized());
    const Eigen::AngleAxisd in_body(3 * t, Vector::UnitZ());
    worst_rad = std::fmax(worst_rad, angle(Rotation(in_space * in_body), to_eigen(s.q_WB)));
    const Vector x(1 - 4.2 * t, 2 + 5.5 * t, 3 + 6.1 * t - kGravity / 2 * t * t);
    worst_m = std::fmax(worst_m, (x - to_eigen(s.p_WBo)).norm());
  }
  CHECK(worst_m < 1e-10);
  CHECK(worst_rad < 1e-8);  // Drake's benchmark takes 1e-3
}

TEST_CASE("P07: attitude and polhode period of exact, drift of every scheme") {
  // Box of P07, w0 = (1, 2, 3) rad/s; after the period of 3.671847303 s W is what it was.
  const Rotation attitude(-0.364863742986863, 0.023563357342589, 0.021262001052007,
                          -0.930519824912735);
  Flight start;
  start.w = {1, 2, 3};
  const Scheme& best = *find_scheme("exact");
  CHECK(angle(run(best, start, kBox, {}, 5, 300).q, attitude) < 1e-8);
  const Flight period = run(best, start, kBox, {}, 3.671847303, 220);
  CHECK((period.q.conjugate() * period.w - start.w).norm() < 1e-8);
  const Flight half = run(best, start, kBox, {}, 3.671847303 / 2, 110);
  CHECK((half.q.conjugate() * half.w - start.w).norm() > 1);

  // Bounds of |E / E0 - 1| and |L - L0| / |L0| over 60 s at 240 Hz.
  struct Bound {
    const char* scheme;
    double energy, momentum;
  };
  const double E0 = rotational_energy(start, kBox);
  const Vector L0 = angular_momentum(start, kBox);
  for (const Bound& bound : {Bound{"exact", 1e-11, 1e-11}, Bound{"rk4", 1e-10, 1e-9},
                             Bound{"stoermer_verlet", 1e-5, 1e-12}}) {
    CAPTURE(bound.scheme);
    Flight body = start;
    Work work;
    double energy = 0, momentum = 0;
    for (int i = 0; i < 60 * 240; ++i) {
      find_scheme(bound.scheme)->advance(body, kBox, {}, 1.0 / 240, work);
      energy = std::fmax(energy, std::abs(rotational_energy(body, kBox) / E0 - 1));
      momentum = std::fmax(momentum, (angular_momentum(body, kBox) - L0).norm() / L0.norm());
    }
    CAPTURE(energy / bound.energy, momentum / bound.momentum);
    CHECK(energy < bound.energy);
    CHECK(momentum < bound.momentum);
  }
  // First order: two gain energy, one loses it, by a few per cent in 5 s.
  const auto drift = [&](const char* name) {
    return rotational_energy(run(*find_scheme(name), start, kBox, {}, 5, 1200), kBox) / E0 - 1;
  };
  CHECK(drift("explicit_euler") == Approx(0.035).margin(0.015));
  CHECK(drift("semi_implicit_euler") == Approx(0.035).margin(0.015));
  CHECK(drift("implicit_euler") == Approx(-0.035).margin(0.015));
}

TEST_CASE("P08: every flip of a minute comes when the elliptic integral says") {
  // w0 = (.05, 5, .05): first at 2.0969670 s, then every 5.110152307 s.
  Flight body;
  body.w = {0.05, 5, 0.05};
  double time_s = 0;
  double last = next_flip(*find_scheme("exact"), body, time_s, 1.0 / 60);
  CHECK(std::abs(last - 2.0969670) < 1e-7);
  for (int flip = 1; flip < 12; ++flip) {
    const double now = next_flip(*find_scheme("exact"), body, time_s, 1.0 / 60);
    CHECK(std::abs(now - last - 5.110152307) < 1e-8);
    last = now;
  }
  // The others by the second flip; 2 % is the tolerance of a default.
  for (const Scheme& scheme : schemes()) {
    CAPTURE(scheme.name);
    Flight other;
    other.w = {0.05, 5, 0.05};
    double t = 0;
    next_flip(scheme, other, t, 1.0 / 3840);
    const double tolerance = scheme.order == 1 ? 0.02 : 1e-5;
    CHECK(next_flip(scheme, other, t, 1.0 / 3840) == Approx(7.2071193).epsilon(tolerance));
  }
}

TEST_CASE("P09: every scheme grows, decays and swings on a spring as its theory says") {
  // m = 1, k = 100 N/m, along x at rest length 3 m. A step of a linear scheme is a matrix: its
  // determinant is the square of the growth of a turning pair, its trace gives the phase.
  for (const double hw : {0.01, 0.1, 1.0, 1.9, 2.1}) {
    for (const Scheme& scheme : schemes()) {
      if (scheme.advance == exact) continue;  // springs.cpp
      CAPTURE(scheme.name, hw);
      const Anchor anchor{Vector::Zero(), {-3, 0, 0}, 100, 0, 3};
      FlightLoads loads;
      loads.anchors = std::span(&anchor, 1);
      const auto step = [&](double x, double v) {  // in units of x and of v / omega
        Flight body;
        body.x.x() = x;
        body.v.x() = 10 * v;
        body = run(scheme, body, {}, loads, hw / 10, 1);
        return Eigen::Vector2d(body.x.x(), body.v.x() / 10);
      };
      Eigen::Matrix2d M;
      M << step(0.1, 0) / 0.1, step(0, 0.1) / 0.1;
      const std::string name = scheme.name;
      const double z = hw * hw;
      double growth = 1, trace = 2 - z;  // semi-implicit Euler and Stoermer-Verlet
      if (name == "explicit_euler") growth = 1 + z, trace = 2;
      if (name == "implicit_euler") growth = 1 / (1 + z), trace = 2 / (1 + z);
      if (name == "rk4") {
        growth = 1 - z * z * z / 72 + z * z * z * z / 576;
        trace = 2 - z + z * z / 12;
      }
      CHECK(M.determinant() == Approx(growth).epsilon(1e-10));
      CHECK(std::abs(M.trace() - trace) < 1e-10);
      // Beyond h omega = 2 one eigenvalue is larger than 1: the two swing up.
      if (growth == 1) CHECK((std::abs(M.trace()) > 2) == (hw > 2));
    }
  }
}

TEST_CASE("P41: a fast spinning body on a slope does not gain speed") {
  // An ellipsoid of semi-axes .05, .1, .15 m, 1 kg, 15 degrees, 30 rad/s, 2 ms, 10 s.
  World world(settings(500));
  BodySpec slope = ground();
  const double half = 7.5 / 180 * std::acos(-1.0);
  slope.q_WB = {std::cos(half), 0, std::sin(half), 0};
  add(world, slope);
  BodySpec body = ball(0.1, {0, 0, 0.3});
  body.shape = Shape::ellipsoid({0.05, 0.1, 0.15});
  body.w_WB = {30, 30, 30};
  const BodyId id = add(world, body);
  double fastest = 0;
  std::int64_t contacts = 0;
  for (int tick = 0; tick < 5000; ++tick) {
    contacts += world.step().contacts;
    fastest = std::fmax(fastest, norm(state(world, id).w_WB));
  }
  CHECK(fastest < 2 * norm(body.w_WB));
  CHECK(contacts > 1000);
}

TEST_CASE("P42: planar motion in space is planar motion") {
  // A body in the plane z = 0 with force, torque about z and drag; in two dimensions by hand, with
  // scalar inertia, and in three by every scheme.
  const Inertia inertia{2, {0.3, 0.4, 0.5}};
  FlightLoads loads;
  loads.force_W = {1, -3, 0};
  loads.torque_W = {0, 0, 0.25};
  loads.drag = {0.3, 0.1, 0.02};
  for (const Scheme& scheme : schemes()) {
    CAPTURE(scheme.name);
    Flight body;
    body.v = {2, 5, 0};
    body.w = {0, 0, 4};
    const Flight end = run(scheme, body, inertia, loads, 5, 300);
    CHECK(std::abs(end.x.z()) + std::abs(end.v.z()) + end.w.head<2>().norm() < 1e-9);
    CHECK(std::abs(end.q.x()) + std::abs(end.q.y()) < 1e-9);
    // J w' = T - c w
    const double h = 1.0 / 60, J = 0.5, T = 0.25, c = 0.02;
    const std::string name = scheme.name;
    if (scheme.order == 1) {
      double w = 4, phi = 0;
      for (int i = 0; i < 300; ++i) {
        const double before = w;
        w = name == "implicit_euler" ? (J * w + h * T) / (J + h * c) : w + h * (T - c * w) / J;
        phi += h * (name == "explicit_euler" ? before : w);
      }
      CHECK(std::abs(end.w.z() - w) < 1e-9);
      CHECK(angle(end.q, Rotation(std::cos(phi / 2), 0, 0, std::sin(phi / 2))) < 1e-9);
    } else {
      const double w = T / c + (4 - T / c) * std::exp(-c * 5 / J);
      CHECK(std::abs(end.w.z() - w) < (scheme.order == 2 ? 1e-6 : 1e-9));
    }
  }
}

TEST_CASE("a constant force and torque over a tick lose no order, and end exactly at their tick") {
  // Seven ticks of 60 Hz: v = F t / m, x = F t^2 / 2m, then coasting; spin likewise.
  World world(weightless());
  Wrench push;
  push.body = add(world, ball(0.5, {}));
  push.value = {6, 0, 0};
  push.duration = WrenchDuration::ticks;
  push.ticks = 7;
  Wrench twist = push;
  twist.quantity = WrenchQuantity::torque;
  twist.value = {0, 0, 0.3};
  REQUIRE(world.push(std::array{push, twist}).result == Result::ok);
  steps(world, 60);
  const double t = 7.0 / 60, rest = 1 - t, J = 0.1;
  const BodyState s = state(world, push.body);
  CHECK(s.v_WBcm.x == Approx(6 * t).epsilon(1e-13));
  CHECK(s.p_WBo.x == Approx(3 * t * t + 6 * t * rest).epsilon(1e-13));
  CHECK(s.w_WB.z == Approx(3 * t).epsilon(1e-13));
  const double phi = 0.3 / J * (t * t / 2 + t * rest);
  CHECK(angle(to_eigen(s.q_WB), Rotation(std::cos(phi / 2), 0, 0, std::sin(phi / 2))) < 1e-13);
}

TEST_CASE("the world moves free bodies by the scheme it is told, and says so in its hash") {
  std::vector<std::array<std::uint8_t, 8>> hashes;
  for (const Scheme& scheme : schemes()) {
    CAPTURE(scheme.name);
    WorldSettings told = settings();
    told.scheme = scheme.name;
    World world(told);
    const auto empty = world.hash();
    for (const auto& other : hashes) CHECK(empty != other);
    hashes.push_back(empty);
    BodySpec spec = brick({0.1, 0.2, 0.3}, {}, {1, 2, 3});
    spec.w_WB = {1, 2, 3};
    const BodyId body = add(world, spec);
    steps(world, 30);
    FlightLoads loads;
    loads.force_W = {0, 0, -kGravity};
    const Flight start{Vector::Zero(), Rotation::Identity(), {1, 2, 3}, {1, 2, 3}};
    const Flight alone = run(scheme, start, kBox, loads, 0.5, 30);
    CHECK((to_eigen(state(world, body).p_WBo) - alone.x).norm() < 1e-12);
    CHECK(angle(to_eigen(state(world, body).q_WB), alone.q) < 1e-12);
  }
  CHECK(scheme_names().front() == WorldSettings{}.scheme);
}

}  // namespace cradle
