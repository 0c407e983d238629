// Bodies that move far in a tick stop on their own side of what is in their way, and are not
// touched by what is not.
#include <catch2/catch.hpp>
#include <numbers>
#include <random>

#include "server/collision/stored_geometry.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

constexpr double kTick_s = 1.0 / 60;

BodySpec wall(const Vec3& half_extents_m, BodyKind kind = BodyKind::fixed) {
  BodySpec spec = brick(half_extents_m, {});
  spec.kind = kind;
  return spec;
}

BodySpec cube(double half_m, const Vec3& p_WBo, const Vec3& v_WBcm = {}) {
  return brick({half_m, half_m, half_m}, p_WBo, v_WBcm);
}

/// Nearly a ball: these bounce at the exact time, and need no stop.
BodySpec pill(double radius_m, const Vec3& p_WBo, const Vec3& v_WBcm = {}) {
  BodySpec spec = ball(radius_m, p_WBo, v_WBcm);
  spec.shape = Shape::capsule(radius_m, 0.001);
  return spec;
}

/// 2 m long, of 5 mm radius, along x for an angle of 0; turning about z.
BodySpec rod(bool is_capsule, double angle, double w) {
  BodySpec spec;
  spec.shape = is_capsule ? Shape::capsule(0.005, 0.995) : Shape::cylinder(0.005, 1);
  spec.mass_kg = 1;
  const double c = std::cos(angle / 2), s = std::sin(angle / 2), half = std::sqrt(0.5);
  spec.q_WB = {c * half, -s * half, c * half, s * half};  // z of the shape to x, then about z
  spec.w_WB = {0, 0, w};
  return spec;
}

Vec3 axis_of(const BodyState& s) {
  const Quat& q = s.q_WB;
  return {2 * (q.x * q.z + q.w * q.y), 2 * (q.y * q.z - q.w * q.x),
          1 - 2 * (q.x * q.x + q.y * q.y)};
}

/// A vector of W, in the frame of a body.
Vec3 in_frame(const Quat& q, const Vec3& d) {
  return to_plain(to_eigen(q).conjugate() * to_eigen(d));
}

/// Steps, and takes note of the worst that happened.
struct Watch {
  World& world;
  double energy_start;
  double energy_most = 0;
  std::int64_t searches = 0;
  int stopped = 0, unresolved = 0;

  explicit Watch(World& w) : world(w), energy_start(w.totals().kinetic_energy_J) {}
  void step() {
    const StepReport report = world.step();
    searches += report.impact_searches;
    stopped += report.stopped_at_impact;
    unresolved += report.impacts_unresolved;
    energy_most = std::fmax(energy_most, world.totals().kinetic_energy_J);
  }
  void check() const {
    CHECK(energy_most <= energy_start * (1 + 1e-9));
    CHECK(unresolved == 0);
  }
};

}  // namespace

TEST_CASE("A10: a bullet stops before the wall, at any speed and wherever its ticks begin") {
  for (const double speed : {100.0, 300.0, 1000.0, 3000.0}) {
    for (int k = 0; k < 12; ++k) {
      World world(weightless());
      add(world, wall({0.01, 2, 2}));
      const double start = -5.003 - k * speed * kTick_s / 12;
      const BodyId bullet = add(world, ball(0.05, {start, 0.3, 0.2}, {speed, 0, 0}));
      Watch watch(world);
      for (int tick = 0; tick < 20; ++tick) watch.step();
      CAPTURE(speed, k);
      CHECK(state(world, bullet).p_WBo.x == Approx(-0.06).margin(1e-3));
      CHECK(state(world, bullet).p_WBo.x < -0.06 + 1e-9);
      CHECK(norm(state(world, bullet).v_WBcm) < 1e-6);
      watch.check();
    }
  }
}

TEST_CASE("a long thin rod that spins beside a thin wall does not pass it") {
  // 120 rad/s are 2 rad a tick; the ends go 120 m/s. The rod begins 0.9 m before the wall's face
  // or nearer, at angles that do not touch it, and is free to move.
  for (const bool is_capsule : {true, false}) {
    for (const double distance : {0.9, 0.5}) {
      for (int k = 0; k < 24; ++k) {
        for (const double w : {120.0, -120.0}) {
          World world(weightless());
          BodySpec thin = wall({0.0005, 3, 3});
          thin.p_WBo = {distance, 0, 0};
          add(world, thin);
          const double angle = k * std::numbers::pi / 12 + 0.01;
          if (std::abs(std::cos(angle)) > distance - 0.02) continue;
          const BodyId body = add(world, rod(is_capsule, angle, w));
          Watch watch(world);
          double farthest = -1e9;
          for (int tick = 0; tick < 60; ++tick) {
            watch.step();
            const BodyState s = state(world, body);
            farthest = std::fmax(farthest, s.p_WBo.x + std::abs(axis_of(s).x) * 0.995 - distance);
          }
          CAPTURE(is_capsule, distance, k, w, watch.stopped);
          CHECK(farthest < 0);
          watch.check();
        }
      }
    }
  }
}

TEST_CASE("a spinning bat that nothing stops hits a small ball") {
  for (int k = 0; k < 24; ++k) {
    World world(weightless());
    const double angle = k * std::numbers::pi / 12;
    BodySpec bat = rod(true, angle, 120);
    bat.kind = BodyKind::kinematic;
    add(world, bat);
    const BodyId struck = add(world, ball(0.03, {0.7, 0, 0}));
    int ticks = 0;
    while (norm(state(world, struck).v_WBcm) == 0 && ticks < 4) {
      world.step();
      ++ticks;
    }
    CAPTURE(k);
    CHECK(norm(state(world, struck).v_WBcm) > 60);  // the bat has 84 m/s there
    CHECK(state(world, struck).v_WBcm.y > 0);
  }
}

TEST_CASE("small fast boxes and hulls stop before thin walls that are static, driven or free") {
  std::mt19937_64 engine(5);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine);
  };
  std::vector<Vector> corners;
  for (int i = 0; i < 14; ++i) {
    corners.push_back(0.06 * Vector{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)});
  }
  const GeometryPointer hull = make_hull(corners).geometry;
  REQUIRE(hull);
  for (const BodyKind kind : {BodyKind::fixed, BodyKind::kinematic, BodyKind::dynamic}) {
    for (int k = 0; k < 40; ++k) {
      World world(weightless());
      BodySpec target = wall({0.005, 1, 1}, kind);
      if (kind == BodyKind::kinematic) target.v_WBcm = {k % 2 == 0 ? -20.0 : 20.0, 0, 0};
      if (kind == BodyKind::dynamic) target.mass_kg = 100;
      const BodyId plate = add(world, target);
      BodySpec shot = brick({uniform(0.02, 0.05), uniform(0.02, 0.05), uniform(0.02, 0.05)}, {});
      if (k % 2 == 0) shot.shape = Shape::stored(ShapeKind::hull, world.add_geometry(hull));
      shot.p_WBo = {-2 - uniform(0, 5), uniform(-0.1, 0.1), uniform(-0.1, 0.1)};
      shot.v_WBcm = {300, 0, 0};
      shot.w_WB = {uniform(-50, 50), uniform(-50, 50), uniform(-50, 50)};
      const BodyId body = add(world, shot);
      Watch watch(world);
      for (int tick = 0; tick < 20; ++tick) {
        watch.step();
        const BodyState s = state(world, body), p = state(world, plate);
        CAPTURE(static_cast<int>(kind), k, tick);
        const Vec3 d = in_frame(p.q_WB, s.p_WBo - p.p_WBo);
        const bool is_beside = std::abs(d.y) > 0.95 || std::abs(d.z) > 0.95;  // slid off
        if (is_beside) break;
        CHECK(d.x < 0);
      }
      CHECK(norm(state(world, body).v_WBcm) < 200);  // it was hit
      if (kind != BodyKind::kinematic) watch.check();
      CHECK(watch.unresolved == 0);
    }
  }
}

TEST_CASE("two bullets head-on do not pass through each other") {
  for (int k = 0; k < 12; ++k) {
    World world(weightless());
    const double start = 3 + k * 500 * kTick_s / 12;
    BodySpec one = ball(0.01, {-start, 0, 0}, {500, 0, 0});
    one.material.friction = 0;
    const BodyId left = add(world, one);
    const double aside = k % 2 == 0 ? 0.0 : 0.002;
    const BodyId right = add(world, ball(0.01, {2.9, aside, 0}, {-500, 0, 0}));
    Watch watch(world);
    for (int tick = 0; tick < 10; ++tick) watch.step();
    CAPTURE(k);
    // Aside, they leave along their common tangent, at 1/10 of their speed.
    CHECK(norm(state(world, left).v_WBcm) == Approx(aside > 0 ? 50 : 0).epsilon(1e-3).margin(1e-6));
    CHECK(norm(state(world, right).v_WBcm) ==
          Approx(aside > 0 ? 50 : 0).epsilon(1e-3).margin(1e-6));
    if (aside == 0) CHECK(state(world, left).p_WBo.x < state(world, right).p_WBo.x - 0.02 + 1e-9);
    watch.check();
  }
}

TEST_CASE("a fast sphere that misses by a millimetre flies as if alone") {
  for (int k = 0; k < 40; ++k) {
    const BodySpec bullet =
        ball(0.05, {-5.003 - k * 0.05, 2.051, 0}, {1000 * (k % 4 + 1) / 4.0, 0, 0});
    World alone(settings()), beside(settings());
    add(alone, bullet);
    const BodyId body = add(beside, bullet);  // first: ids tell nothing
    BodySpec obstacle = wall({0.3, 2, 2});
    obstacle.p_WBo = {0, 0, 0};
    add(beside, obstacle);
    for (int tick = 0; tick < 12; ++tick) {
      alone.step();
      beside.step();
      const BodyState a = state(alone, body), b = state(beside, body);
      CAPTURE(k, tick);
      CHECK(a.p_WBo.x == b.p_WBo.x);
      CHECK(a.p_WBo.y == b.p_WBo.y);
      CHECK(a.p_WBo.z == b.p_WBo.z);
      CHECK(a.v_WBcm.x == b.v_WBcm.x);
      CHECK(a.v_WBcm.y == b.v_WBcm.y);
    }
  }
}

TEST_CASE("a fast body slides and lies on the floor as a slow one does") {
  // A ball of 5 cm at 20 m/s goes 33 cm a tick; it rolls on without friction.
  World world(settings());
  BodySpec floor = wall({100, 100, 0.5});
  floor.p_WBo = {0, 0, -0.5};
  floor.material.friction = 0;
  add(world, floor);
  const BodyId body = add(world, ball(0.05, {-20, 0, 0.05}, {20, 0, 0}));
  Watch watch(world);
  for (int tick = 0; tick < 60; ++tick) watch.step();
  CHECK(state(world, body).p_WBo.x == Approx(0).margin(1e-6));
  CHECK(watch.stopped == 0);
  // A rod that spins on the floor goes on, too.
  World other(settings());
  add(other, floor);
  BodySpec lying = rod(true, 0, 60);
  lying.p_WBo = {0, 0, 0.005};
  lying.material.friction = 0;
  const BodyId spinning = add(other, lying);
  Watch watch_other(other);
  for (int tick = 0; tick < 60; ++tick) watch_other.step();
  CHECK(state(other, spinning).w_WB.z == Approx(60).epsilon(1e-6));
  CHECK(watch_other.stopped == 0);
}

TEST_CASE("what a bullet strikes does not pass the wall behind it in the same tick") {
  // Nothing foresees this: the small cube rests when the tick begins, and its box ends 2 cm from
  // it.
  int stopped = 0;
  for (const double distance : {0.1, 0.5, 5.0}) {
    for (int k = 0; k < 8; ++k) {
      World world(weightless());
      BodySpec thin = wall({0.001, 4, 4});
      thin.p_WBo = {distance, 0, 0};
      add(world, thin);
      const BodyId struck = add(world, cube(0.02, {0, 0, 0}));
      BodySpec heavy = cube(0.05, {-3.0 - k, 0.005, 0}, {600, 0, 0});
      heavy.mass_kg = 100;
      const BodyId bullet = add(world, heavy);
      Watch watch(world);
      for (int tick = 0; tick < 10; ++tick) {
        watch.step();
        CAPTURE(distance, k, tick);
        CHECK(state(world, struck).p_WBo.x < distance);
        CHECK(state(world, bullet).p_WBo.x < distance);
      }
      stopped += watch.stopped;
      watch.check();
    }
  }
  CHECK(stopped > 20);  // at 5 m some are foreseen in the next tick
}

TEST_CASE("a flying body that stops has the velocity of that time") {
  // A bullet drives a pill, at rest when the tick begins, into the way of another that falls past.
  int stopped = 0;
  for (int k = 0; k < 120; ++k) {
    World world(settings(20));
    const double dt = 1.0 / 20, fall = 40;
    BodySpec heavy = pill(0.2, {-2, 0, 0}, {200, 0, 0});
    heavy.mass_kg = 1000;
    add(world, heavy);
    add(world, pill(0.2, {0, 0, 0}));
    const BodyId falling = add(world, pill(0.2, {4 + 0.05 * k, 0, 1.5}, {0, 0, -fall}));
    const double z = state(world, falling).p_WBo.z;
    world.step();
    const BodyState s = state(world, falling);
    const double whole = fall * dt + 0.5 * kGravity * dt * dt;
    const double part = (z - s.p_WBo.z) / whole;
    CAPTURE(k, part);
    if (part > 1 - 1e-9 || s.in_contact) continue;
    ++stopped;
    CHECK(s.v_WBcm.x == 0);
    CHECK(s.v_WBcm.z == Approx(-fall - part * kGravity * dt).epsilon(1e-12));
  }
  CHECK(stopped > 5);
}

TEST_CASE("rods that tumble into walls gain no energy") {
  std::mt19937_64 engine(8);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine);
  };
  for (int k = 0; k < 200; ++k) {
    World world(weightless());
    BodySpec thin = wall({0.0005, 5, 5});
    thin.q_WB = {std::cos(0.2), 0, std::sin(0.2), 0};
    add(world, thin);
    BodySpec thrown = rod(k % 2 == 0, uniform(0, 7), 0);
    thrown.p_WBo = {-1.5 - uniform(0, 2), uniform(-0.3, 0.3), 0};
    thrown.v_WBcm = {uniform(5, 60), uniform(-20, 20), uniform(-20, 20)};
    thrown.w_WB = {uniform(-60, 60), uniform(-60, 60), uniform(-60, 60)};
    const BodyId body = add(world, thrown);
    Watch watch(world);
    for (int tick = 0; tick < 12; ++tick) {
      watch.step();
      const Vec3 d = in_frame(thin.q_WB, state(world, body).p_WBo);
      CAPTURE(k, tick);
      if (std::abs(d.y) > 3.9 || std::abs(d.z) > 3.9) break;
      CHECK(d.x < 0);
    }
    CAPTURE(k);
    watch.check();
  }
}

TEST_CASE("a struck body goes with what it stopped for if nothing can stop that") {
  // The bat is driven at 60 m/s, so fast that its own plane would pass over the ball.
  World world(weightless());
  BodySpec bat = wall({0.001, 1, 1}, BodyKind::kinematic);
  bat.p_WBo = {-3, 0, 0};
  bat.v_WBcm = {60, 0, 0};
  const BodyId driven = add(world, bat);
  const BodyId resting = add(world, ball(0.02, {0, 0.1, 0}));
  const BodyId coming = add(world, ball(0.02, {3, 0.3, 0}, {-200, 0, 0}));
  for (int tick = 0; tick < 20; ++tick) {
    world.step();
    CAPTURE(tick);
    CHECK(state(world, resting).p_WBo.x > state(world, driven).p_WBo.x);
    CHECK(state(world, coming).p_WBo.x > state(world, driven).p_WBo.x);
  }
  CHECK(state(world, resting).v_WBcm.x == Approx(60));
  CHECK(state(world, coming).v_WBcm.x == Approx(60));
}

TEST_CASE("a planar world stops its fast bodies, too") {
  WorldSettings plane = weightless();
  plane.is_planar = true;
  for (int k = 0; k < 12; ++k) {
    World world(plane);
    add(world, wall({0.01, 2, 0.001}));
    BodySpec plank = brick({0.5, 0.005, 0.1}, {-0.6, 0, 0});
    plank.w_WB = {0, 0, k % 2 == 0 ? 130.0 : -130.0};
    plank.q_WB = {std::cos(1.3 + 0.02 * k), 0, 0, std::sin(1.3 + 0.02 * k)};
    plank.v_WBcm = {40, 0, 0};
    const BodyId body = add(world, plank);
    Watch watch(world);
    for (int tick = 0; tick < 20; ++tick) watch.step();
    CAPTURE(k);
    CHECK(state(world, body).p_WBo.x < 0);
    watch.check();
  }
}

TEST_CASE("a planar world stops its fast capsules, polygons and compounds, too") {
  WorldSettings plane = weightless();
  plane.is_planar = true;
  std::vector<Vec2> corners;
  for (int k = 0; k < 7; ++k)
    corners.push_back({0.1 * std::cos(0.9 * k), 0.05 * std::sin(0.9 * k)});
  const Shape wedge = Shape::polygon({-0.1, -0.05}, {0.2, -0.05}, {-0.1, 0.02});
  for (int k = 0; k < 40; ++k) {
    CAPTURE(k);
    World world(plane);
    const GeometryPointer seven = make_polygon(corners).geometry;
    const GeometryPointer pair =
        make_compound({{Shape::sphere(0.04), nullptr, {-0.2, 0, 0}, Rotation::Identity(), 1000},
                       {wedge, nullptr, {0.1, 0, 0}, Rotation::Identity(), 1000}})
            .geometry;
    REQUIRE(seven);
    const Shape shapes[] = {Shape::capsule(0.01, 0.3), wedge, Shape::sphere(0.02),
                            Shape::stored(ShapeKind::hull, world.add_geometry(seven)),
                            Shape::stored(ShapeKind::compound, world.add_geometry(pair))};
    BodySpec thin = wall({0.005, 2, 0.5});
    if (k % 2 == 0)
      thin.shape = Shape::capsule(0.005, 2), thin.q_WB = {std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
    add(world, thin);
    BodySpec bullet;
    bullet.shape = shapes[k % 5];
    bullet.p_WBo = {-3.0 - 0.17 * k, 0.02 * k, 0};
    bullet.q_WB = {std::cos(0.3 * k), 0, 0, std::sin(0.3 * k)};
    bullet.v_WBcm = {300, 0, 0};
    bullet.w_WB = {0, 0, 20.0 * (k % 7)};
    const BodyId body = add(world, bullet);
    for (int tick = 0; tick < 30; ++tick) {
      world.step();
      const Vec3 p = state(world, body).p_WBo;
      if (std::abs(p.y) > 2.5) break;  // off the wall's end
      REQUIRE(p.x < 0);
    }
    CHECK(state(world, body).v_WBcm.x < 1);  // it has struck
  }
}

TEST_CASE("each part of a fast compound stops before each part of another") {
  // A dumb-bell, thrown and spinning, against a frame of two thin plates with 10 cm between.
  const std::array<Vector, 2> ends = {Vector(0, 0.3, 0), Vector(0, -0.3, 0)};
  std::vector<CompoundPart> balls(2), plates(2);
  for (std::size_t k = 0; k < 2; ++k) {
    balls[k].shape = Shape::sphere(0.03);
    balls[k].p_BoPo = ends[k];
    plates[k].shape = Shape::box({0.002, 2, 4});
    plates[k].p_BoPo = {0, k == 0 ? 2.05 : -2.05, 0};
  }
  const GeometryPointer dumb_bell = make_compound(balls).geometry;
  const GeometryPointer frame = make_compound(plates).geometry;
  REQUIRE(dumb_bell);
  REQUIRE(frame);
  int hits = 0;
  for (int k = 0; k < 24; ++k) {
    World world(weightless());
    BodySpec still = wall({1, 1, 1});
    still.shape = Shape::stored(ShapeKind::compound, world.add_geometry(frame));
    add(world, still);
    BodySpec thrown = ball(1, {-2.0 - 0.2 * k, 0.25, 0}, {200, 0, 0});
    thrown.shape = Shape::stored(ShapeKind::compound, world.add_geometry(dumb_bell));
    thrown.w_WB = {0, 0, k % 2 == 0 ? 90.0 : -90.0};
    const BodyId body = add(world, thrown);
    Watch watch(world);
    std::array<double, 2> x_before{};
    std::array<double, 2> y_before{};
    for (int tick = 0; tick < 10; ++tick) {
      watch.step();
      const BodyState s = state(world, body);
      for (std::size_t e = 0; e < 2; ++e) {
        const Vector p = to_eigen(s.p_WBo) + to_eigen(s.q_WB) * ends[e];
        CAPTURE(k, tick, e);
        // It may go through the gap between the plates, and nowhere else.
        if (tick > 0 && x_before[e] < 0 && std::abs(y_before[e]) > 0.4) CHECK(p.x() < 0);
        x_before[e] = p.x(), y_before[e] = p.y();
      }
    }
    hits += norm(state(world, body).v_WBcm) < 190 ? 1 : 0;
    watch.check();
  }
  CHECK(hits > 12);
}

TEST_CASE("where nothing is fast, nothing is searched") {
  World world(settings());
  add(world, ground());
  for (int i = 0; i < 5; ++i) add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0.5 + i}, {3, 0, 0}));
  Watch watch(world);
  for (int tick = 0; tick < 60; ++tick) watch.step();
  CHECK(watch.searches == 0);
}

}  // namespace cradle
