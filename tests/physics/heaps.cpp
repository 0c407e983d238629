// Heaps of cubes that fell as they liked: they come to rest, without sleep.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstring>
#include <numbers>

#include "server/world/contact_cache.h"
#include "tests/bench/poses.h"
#include "tests/physics/flock.h"
#include "tests/physics/worlds.h"

using namespace cradle;

namespace {

constexpr double kPitch = 1.8;

/// With five sides, for a heap.
void add_pit(World& world, int side) {
  const double half = 0.95 * side;
  add(world, ground());
  for (int k = 0; k < 4; ++k) {
    const Vector inward(k == 0 ? 1 : k == 1 ? -1 : 0, k == 2 ? 1 : k == 3 ? -1 : 0, 0);
    BodySpec wall = ground();
    wall.p_WBo = {-half * inward.x(), -half * inward.y(), 0};
    const Rotation q = turn_onto(Vector::UnitZ(), inward);
    wall.q_WB = {q.w(), q.x(), q.y(), q.z()};
    add(world, wall);
  }
}

void add_cubes(World& world, int side, int layers, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  for (int i = 0; i < side * side * layers; ++i) {
    BodySpec cube = brick({0.5, 0.5, 0.5}, {kPitch * (i % side - 0.5 * (side - 1)),
                                            kPitch * (i / side % side - 0.5 * (side - 1)),
                                            1.2 + kPitch * (i / (side * side))});
    const Vector axis = random_axis(random).normalized();
    const Rotation q(Eigen::AngleAxisd(uniform(random, 0, 3), axis));
    cube.q_WB = {q.w(), q.x(), q.y(), q.z()};
    add(world, cube);
  }
}

void add_heap(World& world, int side, int layers, std::uint64_t seed) {
  add_pit(world, side);
  add_cubes(world, side, layers, seed);
}

/// To the last cube, so that nothing is left to be done, within 1600 ticks.
bool comes_to_rest(std::uint64_t seed) {
  World world(settings());
  add_heap(world, 6, 10, seed);
  for (int tick = 0; tick < 1600; ++tick) {
    const StepReport report = world.step();
    if (tick < 200 || report.body_sub_steps + report.islands_by_newton > 0) continue;
    std::vector<BodyState> states;
    world.snapshot(states);
    return std::ranges::all_of(states, [](const BodyState& body) {
      return norm(body.v_WBcm) == 0 && norm(body.w_WB) == 0;
    });
  }
  return false;
}

}  // namespace

TEST_CASE("cubes that fall on each other do not turn into each other") {
  // Less than the 0.15 m that a prototype of this method had in the benchmark's pile, which falls
  // twice as far. Up to 0.22 m, and the worst of a tick 0.033 m in the mean instead of 0.011 m,
  // where faces that slam together as bodies turn about an edge were not foreseen.
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u}) {
    World world(settings());
    add_heap(world, 6, 10, seed);
    double deepest = 0;
    for (int tick = 0; tick < 240; ++tick) {
      deepest = std::max(deepest, world.step().penetration_max_m);
    }
    CAPTURE(seed);
    CHECK(deepest < 0.15);
  }
}

TEST_CASE("a tower beside a heap falls as if alone, to the bit") {
  // In sub-steps like the heap's, and in blocks with its contacts, of which many carry on some of
  // their points only: it is the heap alone whose points are solved by themselves then.
  WorldSettings how = settings();
  how.solver = "soft";
  how.sub_steps = 4;
  World alone(how), beside(how);
  std::vector<BodyId> tower;
  for (World* world : {&alone, &beside}) {
    add(*world, ground());
    tower.clear();
    for (int k = 0; k < 6; ++k) {
      tower.push_back(add(*world, brick({0.5, 0.5, 0.5}, {30, 0.02 * (k % 2), 0.51 + 1.01 * k})));
    }
  }
  add_cubes(beside, 5, 4, 1);
  for (int tick = 0; tick < 150; ++tick) {
    alone.step();
    beside.step();
    for (const BodyId cube : tower) {
      CAPTURE(tick, cube.value);
      REQUIRE(state(alone, cube) == state(beside, cube));
    }
  }
}

TEST_CASE("a heap beside towers that Newton's method has falls as if alone, to the bit") {
  // Soft steps move the heap, in the same tick; one tower rests, one is carried along slowly.
  constexpr double kSpeed = 5e-3;  // m/s
  World alone(settings()), beside(settings());
  for (World* world : {&alone, &beside}) {
    add(*world, ground());
    add_cubes(*world, 5, 4, 1);
  }
  BodySpec plate = brick({1, 1, 0.5}, {40, 0, 0.5}, {kSpeed, 0, 0});
  plate.kind = BodyKind::kinematic;
  add(beside, plate);
  std::vector<BodyId> resting, carried;
  for (int k = 0; k < 6; ++k) {
    resting.push_back(add(beside, brick({0.5, 0.5, 0.5}, {30, 0, 0.5 + k})));
    carried.push_back(add(beside, brick({0.5, 0.5, 0.5}, {40, 0, 1.5 + k}, {kSpeed, 0, 0})));
  }
  std::vector<BodyState> one, both;
  int with_both = 0;  // ticks
  for (int tick = 0; tick < 150; ++tick) {
    CAPTURE(tick);
    alone.step();
    const StepReport report = beside.step();
    REQUIRE(report.islands_at_rest + report.islands_by_newton >= 2);
    with_both += report.islands > report.islands_at_rest + report.islands_by_newton ? 1 : 0;
    alone.snapshot(one);
    beside.snapshot(both);
    // But for the ground, which the tower touches.
    REQUIRE(
        std::ranges::equal(std::span(one).subspan(1), std::span(both).subspan(1, one.size() - 1)));
  }
  CHECK(with_both > 50);
  for (int k = 0; k < 6; ++k) {
    CAPTURE(k);
    const Vec3 at = state(beside, resting[static_cast<std::size_t>(k)]).p_WBo;
    CHECK(norm(at - Vec3{30, 0, 0.5 + k}) < 1e-6);
    const Vec3 on = state(beside, carried[static_cast<std::size_t>(k)]).p_WBo;
    CHECK(norm(on - Vec3{40 + kSpeed * 2.5, 0, 1.5 + k}) < 1e-6);
  }
}

TEST_CASE("heaps of cubes come to rest") {
  // What kept them in motion for good, each with a period of a few ticks: contacts that changed
  // between a face and edges, or which of a face's points stood for it, and forgot what they had
  // carried; points that took turns to stand for what overlaps beside them; and a preload that
  // followed the force of the tick before. What is left, 26 of 390: a cube that turns about two
  // points that hold it, to which nothing of the model is opposed; and the point where edges that
  // are nearly parallel cross, which runs along them by centimetres in a tick of which bodies move
  // by 0.1 mm.
  // Which ones is chance: another rounding has others. Of 120 such heaps of which nine in ten come
  // to rest, 100 do in 99 of 100 sets; where three in four do, in one of forty.
  int resting = 0, of_sixty = 0;
  for (std::uint64_t seed = 1; seed <= 120; ++seed) {
    resting += comes_to_rest(seed) ? 1 : 0;
    if (seed == 60) of_sixty = resting;
  }
  CHECK(of_sixty >= 51);
  CHECK(resting >= 100);
}

namespace {

/// Of slots 0 and 1, along z.
ContactConstraint contact_of_four() {
  ContactConstraint c;
  c.b = 1;
  c.n = Vector::UnitZ();
  c.t1 = tangent(c.n);
  c.count = 4;
  return c;
}

/// What `c` knows a tick after `before`: from its place, or from entries, which is the same.
ContactConstraint restored(const ContactConstraint& before, const ContactConstraint& c,
                           std::size_t* entries = nullptr) {
  ContactCache cache;
  ContactConstraint from_place = c, from_entries = c;
  const auto follow = [&cache] {
    cache.follow(serial_executor, 1, [](std::size_t) { return ContactName{{1, 2}}; });
  };
  follow();
  cache[0] = before;
  const auto restore = [&](ContactConstraint& after) {
    follow();
    ContactMemory memory;
    cache.recall(0, memory);
    memory.restore(after);
  };
  restore(from_place);
  const std::size_t count = cache.entries().size();
  if (entries != nullptr) *entries = count;
  restore(from_entries);
  CHECK(std::memcmp(&from_place.points, &from_entries.points, sizeof(c.points)) == 0);
  CHECK(std::memcmp(&from_place.rests, &from_entries.rests, sizeof(c.rests)) == 0);
  CHECK(from_place.K_normals == from_entries.K_normals);
  CHECK(from_place.is_known == from_entries.is_known);
  return from_place;
}

}  // namespace

TEST_CASE(
    "points that are new carry what those that have gone did, with the same force and torque") {
  ContactConstraint before = contact_of_four();
  std::mt19937_64 random(5);
  const auto torque = [](const ContactConstraint& c) {
    Vector sum = Vector::Zero();
    for (const ConstraintPoint& p : c.used()) sum += p.rA.cross(c.n) * p.force;
    return sum;
  };
  const auto force = [](const ContactConstraint& c) {
    double sum = 0;
    for (const ConstraintPoint& p : c.used()) sum += p.force;
    return sum;
  };
  for (int trial = 0; trial < 1000; ++trial) {
    // A square, and the same turned by 45 degrees; one point may keep its name.
    ContactConstraint after = before;
    const bool keeps_one = trial % 2 == 0;
    for (int k = 0; k < 4; ++k) {
      const double angle = k * std::numbers::pi / 2;
      const auto i = static_cast<std::size_t>(k);
      ConstraintPoint &p = before.points[i], &q = after.points[i];
      p.rA = {std::cos(angle), std::sin(angle), 0.5};
      p.force = 10 + uniform(random, -1, 1);
      before.features[i] = after.features[i] = static_cast<std::uint32_t>(k);
      q = p;
      q.force = 0;
      if (keeps_one && k == 0) continue;
      q.rA = {std::cos(angle + std::numbers::pi / 4), std::sin(angle + std::numbers::pi / 4), 0.5};
      after.features[i] += 10;
    }
    after = restored(before, after);
    CHECK(after.is_known);
    CHECK(force(after) == Approx(force(before)).epsilon(1e-9));
    CHECK((torque(after) - torque(before)).norm() < 1e-6);
    for (const ConstraintPoint& p : after.used()) CHECK(p.force >= 0);
    if (keeps_one) CHECK(after.points[0].force == before.points[0].force);
  }
  // Not to the points of another face.
  ContactConstraint after = before;
  for (ConstraintPoint& p : after.used()) {
    p.rA = {p.rA.z(), p.rA.x(), p.rA.y()};
    p.force = 0;
  }
  for (std::uint32_t& feature : after.features) feature += 20;
  after.n = Vector::UnitX();
  after.t1 = tangent(after.n);
  CHECK(force(restored(before, after)) == 0);
}

TEST_CASE("of a contact that carries nothing one entry tells that it was there") {
  ContactConstraint before = contact_of_four();
  for (std::uint32_t k = 0; k < 4; ++k) {
    before.features[k] = k;
    before.points[k].rA = {0.1 * k, 0.2 * k, 0.5};
    before.K_normals[k] = 2;
  }
  std::size_t entries = 0;
  const auto after_a_tick = [&] {
    ContactConstraint after = before;
    for (ConstraintPoint& p : after.used()) p.press = 0;
    after.K_normals = {};
    after.rests = {};
    after.has_rested = false;
    return restored(before, after, &entries);
  };
  const ContactConstraint idle = after_a_tick();
  CHECK(entries == 1);
  CHECK(idle.is_known);
  for (const double K : idle.K_normals) CHECK(K == 2);  // else it would be new

  before.points[2].press = 3;  // it has let go, and remembers
  const ContactConstraint pressed = after_a_tick();
  CHECK(entries == 4);
  CHECK(pressed.points[2].press == 3);
  CHECK(pressed.K_normals[1] == 2);
  CHECK_FALSE(pressed.has_rested);

  before.points[2].press = 0;
  before.set_rest(before.points[2], {1e-3, 5});  // nor is it idle where it rests elsewhere
  const ContactConstraint rested = after_a_tick();
  CHECK(entries == 4);
  CHECK(rested.has_rested);
  CHECK(rested.rests[2].m == 1e-3);
  CHECK(rested.rests[2].load == 5);
}

TEST_CASE("a contact whose points are last tick's carries the same, in another frame, too") {
  // The normal turns to where the tangents are others, by a quarter turn.
  ContactConstraint before = contact_of_four();
  before.n = Vector(0.56, 0.1, 0.82).normalized();
  before.t1 = tangent(before.n);
  Manifold manifold;
  manifold.normal_W = Vector(0.58, 0.1, 0.81).normalized();
  manifold.count = before.count;
  for (std::uint32_t k = 0; k < 4; ++k) {
    ConstraintPoint& p = before.points[k];
    p.force = 3 + k;
    p.press = 7;
    p.force_t = {1, 0.5 * k};
    before.K_normals[k] = 2 + k;
    before.features[k] = 10 - k;
    manifold.points[k] = {{0.1 * k, 0.2, 0.3}, -1e-3 * k, 10 - k};
  }
  std::vector<Vector> x = {Vector(0, 0, -1), Vector(0.1, 0, 1)}, none(2, Vector::Zero());
  std::vector<Rotation> q(2, Rotation::Identity());
  const std::vector<double> inverse_mass = {0, 2};
  const std::vector<Matrix> inverse_inertia(2, Matrix::Identity());
  const BodyArrays bodies{x, q, none, none, inverse_mass, none, none, none, none};

  ContactConstraint renewed = before;
  REQUIRE(has_same_points(renewed, manifold));
  renew_constraint(renewed, manifold, 0, 1, bodies, inverse_inertia);
  for (std::size_t k = 0; k < 4; ++k) {
    const auto friction = [k](const ContactConstraint& c) {
      return Vector(c.points[k].force_t.x() * c.t1 + c.points[k].force_t.y() * c.t2());
    };
    const Vector out = manifold.normal_W.dot(friction(before)) * manifold.normal_W;
    CHECK((friction(renewed) - (friction(before) - out)).norm() < 1e-14);
  }
  const auto check_as_anew = [&] {
    renewed = before;
    renew_constraint(renewed, manifold, 0, 1, bodies, inverse_inertia);
    const ContactConstraint anew =
        restored(before, make_constraint(manifold, 0, 1, bodies, inverse_inertia));
    CHECK(std::memcmp(&renewed.points, &anew.points, sizeof(anew.points)) == 0);
    CHECK(renewed.K_normals == anew.K_normals);
    CHECK(renewed.features == anew.features);
    CHECK(renewed.is_known == anew.is_known);
  };
  check_as_anew();
  for (ConstraintPoint& p : before.used()) p.force = p.press = 0, p.force_t.setZero();
  check_as_anew();

  manifold.points[2].feature = 20;
  CHECK_FALSE(has_same_points(before, manifold));
  manifold.points[2].feature = 8;
  before.set_rest(before.points[0], {1e-3, 5});
  CHECK_FALSE(has_same_points(before, manifold));
}
