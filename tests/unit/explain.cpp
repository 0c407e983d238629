// What bodies do without, against the full model: the bound holds, and is not idle.
#include "server/explain.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "server/dynamics/rotation.h"
#include "tests/physics/flock.h"

namespace cradle {
namespace {

Vec3 vec(std::mt19937_64& random, double size) { return to_plain(random_vector(random, size)); }

template <class T>
T one_of(std::mt19937_64& random, std::initializer_list<T> all) {
  return all.begin()[random() % all.size()];
}

double log_uniform(std::mt19937_64& random, double low, double high) {
  return low * std::pow(high / low, uniform(random, 0, 1));
}

/// 40 m apart: at speeds of 5 m/s most of them meet nobody in a second.
BodySpec random_body(std::mt19937_64& random, int number) {
  BodySpec body;
  body.mass_kg = log_uniform(random, 0.1, 10);
  switch (random() % 6) {
    case 0:  // a point
      break;
    case 1:
      body.shape = Shape::sphere(uniform(random, 0.1, 1));
      break;
    case 2:
      body.shape = Shape::box({uniform(random, 0.1, 1), 0.5, 0.2});
      break;
    case 3:
      body.shape = Shape::box({0.3, 0.3, 0.3});
      break;
    case 4:
      body.shape = Shape::cone(0.3, uniform(random, 0.1, 1));
      break;
    default:
      body.inertia_kgm2 = to_plain(random_inertia(random));
  }
  body.kind = random() % 8 == 0 ? BodyKind::kinematic : BodyKind::dynamic;
  if (body.kind == BodyKind::kinematic) body.mass_kg = 0;
  const bool is_point = body.shape.kind == ShapeKind::none && body.inertia_kgm2 == Vec3{};
  if (body.kind == BodyKind::dynamic && !is_point && random() % 4 == 0) {
    body.sets_centre_of_mass = true;
    body.p_BoBcm = vec(random, 0.2);
  }
  body.p_WBo = {40.0 * number, uniform(random, -5, 5), 0};
  body.q_WB =
      to_plain(normalised(Rotation(1, uniform(random, -1, 1), uniform(random, -1, 1), 0.3)));
  body.v_WBcm = vec(random, 5);
  if (random() % 5 != 0) body.w_WB = to_plain(log_uniform(random, 0.01, 60) * random_axis(random));
  return body;
}

Wrench random_wrench(std::mt19937_64& random) {
  using enum WrenchQuantity;
  Wrench wrench;
  wrench.quantity = one_of(random, {force, torque, impulse, angular_impulse, acceleration});
  wrench.frame = one_of(random, {WrenchFrame::world, WrenchFrame::body});
  wrench.value = vec(random, log_uniform(random, 0.001, 1));
  const bool is_couple = wrench.quantity == torque || wrench.quantity == angular_impulse;
  if (!is_couple && random() % 2 == 0) {
    wrench.point_kind = WrenchPoint::body_point;
    wrench.point = vec(random, 0.3);
  }
  wrench.duration = one_of(
      random, {WrenchDuration::this_tick, WrenchDuration::ticks, WrenchDuration::until_cleared});
  if (wrench.duration == WrenchDuration::ticks) wrench.ticks = 1 + static_cast<int>(random() % 20);
  return wrench;
}

Scene random_scene(std::mt19937_64& random) {
  Scene scene;
  scene.settings.rate_hz = one_of(random, {30.0, 60.0, 100.0, 240.0});
  const auto bodies = 1 + random() % 6;
  for (std::size_t i = 0; i < bodies; ++i) {
    scene.bodies.push_back(random_body(random, static_cast<int>(i)));
    if (scene.bodies.back().kind != BodyKind::dynamic || random() % 3 != 0) continue;
    scene.wrenches.push_back({1, i, random_wrench(random)});
  }
  return scene;
}

/// Distance of Bo and angle between the attitudes.
struct Difference {
  double distance_m = 0, angle_rad = 0;
};
Difference difference(const BodyState& a, const BodyState& b) {
  const Rotation turn = to_eigen(a.q_WB).conjugate() * to_eigen(b.q_WB);
  const Vector apart = to_eigen(a.p_WBo) - to_eigen(b.p_WBo);
  return {apart.norm(), 2 * std::atan2(turn.vec().norm(), std::abs(turn.w()))};
}

/// A scene with what its bodies need, and beside it the full model.
struct Both {
  SerialExecutor here;
  SceneRun lean, full;
  Explanation explanation;

  explicit Both(const Scene& scene) : lean(scene), full(full_of(scene)), explanation(lean) {}
  static Scene full_of(Scene scene) {
    scene.settings.is_full = true;
    return scene;
  }
  void step() {
    explanation.step(here);
    full.step(here);
  }
  Difference difference_of(std::size_t body) const {
    BodyState a, b;
    REQUIRE(lean.world().find(lean.id(body), a));
    REQUIRE(full.world().find(full.id(body), b));
    return difference(a, b);
  }
};

/// What was seen of a kind of body, and what the bounds said.
struct Kind {
  const char* what;
  double seen_rad = 0, bound_rad = 0;  // the largest
  std::vector<double> ratios;          // bound to difference, of bodies that differ
};

}  // namespace

TEST_CASE("what a body does without keeps within its bound, over 1000 random scenes") {
  std::mt19937_64 random(7);
  Kind still{"does not turn", 0, 0, {}}, steady{"turns evenly", 0, 0, {}};
  Kind tumbling{"tumbles", 0, 0, {}};
  for (int number = 0; number < 1000; ++number) {
    CAPTURE(number);
    const Scene scene = random_scene(random);
    Both both(scene);
    const auto ticks = 1 + random() % 60;
    for (std::uint64_t tick = 0; tick < ticks; ++tick) both.step();
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
      Explanation::Bound bound;
      if (!both.explanation.bound(i, bound)) continue;
      const Difference seen = both.difference_of(i);
      CAPTURE(i, 1e15 * seen.angle_rad, 1e15 * bound.angle_rad);
      CAPTURE(1e15 * seen.distance_m, 1e15 * bound.distance_m);
      REQUIRE(seen.angle_rad <= bound.angle_rad);
      REQUIRE(seen.distance_m <= bound.distance_m);
      const Turn turn = both.lean.world().accounts()[i].need.turn;
      Kind& kind = turn == Turn::none ? still : turn == Turn::steady ? steady : tumbling;
      kind.seen_rad = std::fmax(kind.seen_rad, seen.angle_rad);
      kind.bound_rad = std::fmax(kind.bound_rad, bound.angle_rad);
      if (seen.angle_rad > 0) kind.ratios.push_back(bound.angle_rad / seen.angle_rad);
    }
  }
  for (Kind* kind : {&still, &steady, &tumbling}) {
    CAPTURE(kind->what, 1e15 * kind->seen_rad, 1e15 * kind->bound_rad, kind->ratios.size());
    CHECK(kind->bound_rad <= 100 * kind->seen_rad);
    REQUIRE(kind->ratios.size() > 100);
    std::sort(kind->ratios.begin(), kind->ratios.end());
    CHECK(kind->ratios[kind->ratios.size() / 2] <= 100);
  }
}

TEST_CASE("what is left out is counted, and what is exact has no error") {
  Scene scene;
  BodySpec point;
  point.mass_kg = 1;
  point.v_WBcm = {1, 2, 3};
  BodySpec top = point;
  top.p_WBo = {10, 0, 0};
  top.inertia_kgm2 = {1, 2, 3};
  top.w_WB = {0.1, 5, 0.1};
  BodySpec ball = point;
  ball.p_WBo = {20, 0, 0};
  ball.shape = Shape::sphere(0.5);
  ball.w_WB = {0, 40, 0};
  scene.bodies = {point, top, ball};
  BodySpec landing = ball;  // touches, and stays
  landing.p_WBo = {30, 0, -100};
  landing.v_WBcm = {};
  BodySpec ground;
  ground.kind = BodyKind::fixed;
  ground.shape = Shape::half_space();
  ground.p_WBo = {0, 0, -100.4};
  scene.bodies.push_back(landing);
  scene.bodies.push_back(ground);

  Both both(scene);
  for (int tick = 0; tick < 60; ++tick) both.step();
  const auto savings = both.explanation.savings();
  const auto saving = [&](Omission which) { return savings[static_cast<std::size_t>(which)]; };
  CHECK(saving(Omission::rotation).bodies == 1);
  CHECK(saving(Omission::gyroscopic_term).bodies == 1);
  CHECK(saving(Omission::torque_series).bodies == 1);
  CHECK(saving(Omission::common_rate).bodies == 1);
  CHECK(saving(Omission::sub_steps).bodies == 3);
  CHECK(saving(Omission::contact).bodies == 2);
  CHECK(both.explanation.touching() == 1);
  CHECK(both.explanation.one_by_one() == 0);
  CHECK(saving(Omission::common_rate).angle_rad > 1e-12);
  CHECK(saving(Omission::torque_series).angle_rad == 0);
  const Difference of_point = both.difference_of(0);
  CHECK(of_point.distance_m == 0);  // to the last bit
  CHECK(both.explanation.steps_most() == 1);

  const std::string text = to_text(both.explanation, both.lean, 60);
  CHECK(text.find("5 bodies, 60 ticks of 16.6667 ms") == 0);
  CHECK(text.find("1 bodies came into contact") != std::string::npos);
}

TEST_CASE("looking at what bodies need changes nothing, and the full model is another hash") {
  std::mt19937_64 random(8);
  SerialExecutor here;
  const Scene scene = random_scene(random);
  SceneRun plain(scene);
  Both both(scene);
  for (int tick = 0; tick < 20; ++tick) {
    both.step();
    plain.step(here);
  }
  CHECK(plain.world().hash() == both.lean.world().hash());
  CHECK(plain.world().hash() != both.full.world().hash());
}

}  // namespace cradle
