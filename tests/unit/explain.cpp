// What bodies do without, against the full model: the bound holds, and is not idle.
#include "server/explain.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <random>

#include "server/collision/bounds.h"
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
      to_plain(normalised(Rotation{1.0, uniform(random, -1, 1), uniform(random, -1, 1), 0.3}));
  body.v_WBcm = vec(random, 5);
  if (random() % 5 != 0) body.w_WB = to_plain(log_uniform(random, 0.01, 60) * random_axis(random));
  if (body.shape.kind == ShapeKind::box && random() % 4 == 0) {  // about its middle axis
    body.w_WB = to_plain(to_eigen(body.q_WB) * Vector(0.001, uniform(random, 1, 5), 0.001));
  }
  return body;
}

/// On a body at p_WBo.
Wrench random_wrench(std::mt19937_64& random, const Vec3& p_WBo) {
  using enum WrenchQuantity;
  Wrench wrench;
  wrench.quantity = one_of(random, {force, torque, impulse, angular_impulse, acceleration});
  wrench.frame = one_of(random, {WrenchFrame::world, WrenchFrame::body});
  wrench.value = vec(random, log_uniform(random, 0.001, 1));
  const bool is_couple = wrench.quantity == torque || wrench.quantity == angular_impulse;
  if (!is_couple && random() % 2 == 0) {
    wrench.point_kind = one_of(random, {WrenchPoint::body_point, WrenchPoint::world_point});
    wrench.point = vec(random, 0.3);
    if (wrench.point_kind == WrenchPoint::world_point) {
      wrench.point = to_plain(to_eigen(wrench.point) + to_eigen(p_WBo));
    }
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
    scene.wrenches.push_back({1, i, random_wrench(random, scene.bodies.back().p_WBo)});
  }
  return scene;
}

/// Largest distance of a point of the body's, and angle between the attitudes.
struct Gap {
  double distance_m = 0, angle_rad = 0;
};
/// Of points at `reach_m` from Bo, all around, and Bo. Differences are taken before coordinates are
/// added: beside a place of 200 m they would be rounded away.
Gap difference(const BodyState& a, const BodyState& b, double reach_m) {
  const Rotation turn = to_eigen(a.q_WB).conjugate() * to_eigen(b.q_WB);
  const Vector apart = to_eigen(a.q_WB).conjugate() * (to_eigen(a.p_WBo) - to_eigen(b.p_WBo));
  const Vector axis = (turn.w() < 0 ? -2.0 : 2.0) * turn.vec();
  double most = apart.norm();
  for (int i = 0; i < 27; ++i) {
    if (i == 13) continue;  // Bo
    const Vector point = reach_m * Vector(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1).normalized();
    // turn * point - point, for q = (s, v): 2 v x (s point + v x point)
    const Vector by = axis.cross(std::abs(turn.w()) * point + axis.cross(point) / 2);
    most = std::fmax(most, (apart - by).norm());
  }
  return {most, 2 * std::atan2(turn.vec().norm(), std::abs(turn.w()))};
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
  Gap difference_of(std::size_t body) const {
    BodyState a, b;
    REQUIRE(lean.world().find(lean.id(body), a));
    REQUIRE(full.world().find(full.id(body), b));
    const Shape& shape = lean.scene().bodies[body].shape;
    return difference(a, b, shape.kind == ShapeKind::none ? 0 : bounding_radius(shape));
  }
};

/// By a force that turns with it: its place, too, differs from that of the full model.
bool is_pushed_along(const Scene& scene, std::size_t body) {
  for (const TimedWrench& timed : scene.wrenches) {
    const WrenchQuantity what = timed.wrench.quantity;
    const bool is_couple =
        what == WrenchQuantity::torque || what == WrenchQuantity::angular_impulse;
    if (timed.body == body && timed.wrench.frame == WrenchFrame::body && !is_couple) return true;
  }
  return false;
}

/// What was seen of a kind of body, and what the bounds said.
struct DifferenceKind {
  const char* what;
  Gap seen, bound;                       // the largest
  std::vector<double> ratios, ratios_m;  // bound to difference, of bodies that differ

  void add(const Gap& s, const Explanation::Bound& b) {
    seen = {std::fmax(seen.distance_m, s.distance_m), std::fmax(seen.angle_rad, s.angle_rad)};
    bound = {std::fmax(bound.distance_m, b.distance_m), std::fmax(bound.angle_rad, b.angle_rad)};
    if (s.angle_rad > 0) ratios.push_back(b.angle_rad / s.angle_rad);
    if (s.distance_m > 0) ratios_m.push_back(b.distance_m / s.distance_m);
  }
};

double median(std::vector<double> values) {
  REQUIRE(values.size() > 50);
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

}  // namespace

TEST_CASE("what a body does without keeps within its bound, over 1000 random scenes") {
  std::mt19937_64 random(7);
  DifferenceKind still{"does not turn", {}, {}, {}, {}}, steady{"turns evenly", {}, {}, {}, {}};
  DifferenceKind tumbling{"tumbles", {}, {}, {}, {}},
      pushed{"pushed along its axes", {}, {}, {}, {}};
  std::int64_t unknown = 0;
  for (int number = 0; number < 1000; ++number) {
    CAPTURE(number);
    const Scene scene = random_scene(random);
    Both both(scene);
    const double most_s = number % 10 == 0 ? 10 : 1;
    const auto most = static_cast<std::uint64_t>(most_s * scene.settings.rate_hz);
    const auto ticks = 1 + random() % most;
    for (std::uint64_t tick = 0; tick < ticks; ++tick) both.step();
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
      Explanation::Bound bound;
      if (!both.explanation.bound(i, bound)) continue;
      if (!bound.is_known()) {
        ++unknown;
        continue;
      }
      const Gap seen = both.difference_of(i);
      CAPTURE(i, 1e15 * seen.angle_rad, 1e15 * bound.angle_rad);
      CAPTURE(1e15 * seen.distance_m, 1e15 * bound.distance_m);
      REQUIRE(seen.angle_rad <= bound.angle_rad);
      REQUIRE(seen.distance_m <= bound.distance_m);
      const Turn turn = both.lean.world().accounts()[i].need.turn;
      DifferenceKind& kind = is_pushed_along(scene, i) ? pushed
                             : turn == Turn::none      ? still
                             : turn == Turn::steady    ? steady
                                                       : tumbling;
      kind.add(seen, bound);
    }
  }
  CHECK(unknown < 10);
  for (const DifferenceKind* kind : {&still, &steady, &tumbling, &pushed}) {
    CAPTURE(kind->what, 1e15 * kind->seen.angle_rad, 1e15 * kind->bound.angle_rad);
    CAPTURE(1e15 * kind->seen.distance_m, 1e15 * kind->bound.distance_m);
    CAPTURE(median(kind->ratios), median(kind->ratios_m));
    CHECK(kind->bound.angle_rad <= 100 * kind->seen.angle_rad);
    CHECK(kind->bound.distance_m <= 100 * kind->seen.distance_m);
    CHECK(median(kind->ratios) <= 100);
    CHECK(median(kind->ratios_m) <= 100);
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
  const Gap of_point = both.difference_of(0);
  CHECK(of_point.distance_m == 0);  // to the last bit
  CHECK(both.explanation.steps_most() == 1);

  const std::string text = to_text(both.explanation, both.lean, 60);
  CHECK(text.find("5 bodies, 60 ticks of 16.6667 ms") == 0);
  CHECK(text.find("1 bodies came into contact") != std::string::npos);

  Scene rest;  // all of its bodies touch: no row has a bound
  rest.bodies = {landing, ground};
  rest.bodies[0].p_WBo.z = -99.5;  // after a short fall
  Both at_rest(rest);
  for (int tick = 0; tick < 120; ++tick) at_rest.step();
  const std::string no_bound = to_text(at_rest.explanation, at_rest.lean, 120);
  CHECK(no_bound.find("sub-steps               1         -         -") != std::string::npos);
}

// A force that turns with the body, at a point of the world: the error of the place grows with
// itself.
TEST_CASE("an error beyond bounds is unknown, not zero") {
  Scene scene;
  BodySpec body;
  body.mass_kg = 1;
  body.inertia_kgm2 = {1, 2, 3};
  body.p_WBo = {1000, 0, 0};
  body.w_WB = {1, 2, 3};
  scene.bodies = {body};
  Wrench wrench;
  wrench.frame = WrenchFrame::body;
  wrench.point_kind = WrenchPoint::world_point;
  wrench.point = {1000, 0, 1};
  wrench.value = {0, 3, 10};
  wrench.duration = WrenchDuration::until_cleared;
  scene.wrenches = {{1, 0, wrench}};
  SceneRun run(scene);
  Explanation explanation(run);
  SerialExecutor here;
  Explanation::Bound bound;
  for (int tick = 0; tick < 60; ++tick) explanation.step(here);
  REQUIRE(explanation.bound(0, bound));
  CHECK(bound.is_known());
  for (int tick = 0; tick < 60 * 60; ++tick) explanation.step(here);
  REQUIRE(explanation.bound(0, bound));
  CHECK_FALSE(bound.is_known());
  CHECK(bound.angle_rad == std::numbers::pi);
  CHECK(bound.distance_m == std::numeric_limits<double>::infinity());
  const auto saving = explanation.savings()[static_cast<std::size_t>(Omission::common_rate)];
  CHECK(saving.distance_m == bound.distance_m);
  CHECK(saving.angle_rad == bound.angle_rad);
  const std::string text = to_text(explanation, run, 61 * 60);
  CHECK(text.find("smaller steps           1   unknown   unknown") != std::string::npos);
}

// Its small turns are rounded alike, in each of the many steps that the full model takes.
TEST_CASE("a slow ball beside a fast body keeps within its bound") {
  const double speed = GENERATE(30, 300, 3000);
  for (const Quat& q :
       {Quat{0.2, 0.1, 0.9, 0.3}, Quat{1, -0.9, 0.2, 0.3}, Quat{1, 0.5, -0.7, 0.3}}) {
    for (const Vec3& w :
         {Vec3{0.0003, 0.0003, 0.068}, Vec3{0.4, -0.4, 0.9}, Vec3{-0.00687, 0.0204, -0.0332}}) {
      Scene scene;
      BodySpec slow;
      slow.shape = Shape::sphere(0.2);
      slow.mass_kg = 1;
      slow.q_WB = to_plain(normalised(to_eigen(q)));
      slow.w_WB = w;
      BodySpec fast;
      fast.p_WBo = {100, 0, 0};
      fast.mass_kg = 1;
      fast.inertia_kgm2 = {1, 2, 3};
      fast.w_WB = {speed, 1.3 * speed, speed};
      scene.bodies = {slow, fast};
      Both both(scene);
      for (int tick = 1; tick <= 240; ++tick) {
        both.step();
        if (tick % 60 != 0) continue;
        Explanation::Bound bound;
        REQUIRE(both.explanation.bound(0, bound));
        const Gap seen = both.difference_of(0);
        CAPTURE(speed, tick, 1e15 * seen.angle_rad, 1e15 * bound.angle_rad);
        CHECK(seen.angle_rad <= bound.angle_rad);
        CHECK(seen.distance_m <= bound.distance_m);
      }
    }
  }
}

TEST_CASE("bodies with drag are told not to be bounded") {
  Scene scene;
  BodySpec ball;
  ball.mass_kg = 1;
  ball.shape = Shape::sphere(0.5);
  scene.bodies = {ball};
  scene.drags = {{0.1, 0, 0}};
  SceneRun run(scene);
  Explanation explanation(run);
  SerialExecutor here;
  explanation.step(here);
  Explanation::Bound bound;
  CHECK_FALSE(explanation.bound(0, bound));
  const std::string text = to_text(explanation, run, 1);
  CHECK(text.find("1 bodies move one by one, with drag") != std::string::npos);
  CHECK(text.find("not bounded here") != std::string::npos);
  CHECK(text.find("nothing is left out") == std::string::npos);
}

TEST_CASE("sub-steps are told by groups, with the sag to expect, also of what sleeps by now") {
  Scene scene;
  scene.settings.solver = "soft";
  BodySpec ground;
  ground.kind = BodyKind::fixed;
  ground.shape = Shape::half_space();
  BodySpec cube;
  cube.shape = Shape::box({0.5, 0.5, 0.5});
  cube.mass_kg = 1;
  cube.p_WBo = {0, 0, 0.5};
  BodySpec heavy = cube;
  heavy.p_WBo.z = 1.5;
  heavy.mass_kg = 100;
  BodySpec alone = cube;
  alone.p_WBo.x = 5;
  scene.bodies = {ground, cube, heavy, alone};
  scene.drags.resize(4);
  SceneRun run(scene);
  Explanation explanation(run);
  SerialExecutor here;
  for (int tick = 0; tick < 300; ++tick) explanation.step(here);
  CHECK(run.world().sub_step_choices().empty());
  REQUIRE(explanation.choices().size() == 1);  // the lighter group fell asleep before
  CHECK(explanation.choices_tick() > 30);
  const SubStepChoice& last = explanation.choices().front();
  CHECK(last.sub_steps == 24);  // 0.0150 s * sqrt(1.1 * 991 / 5e-4) = 22.1
  CHECK(last.islands == 1);
  CHECK(last.bodies == 2);
  CHECK(last.sag_m == Approx(1.1 * 991 * std::pow(1.0 / 60 / 24 / 1.112, 2)).epsilon(0.15));
  const std::string text = to_text(explanation, run, 300);
  CHECK(text.find("       24        1        2") != std::string::npos);
  CHECK(text.find("keep its sag below 0.5 mm") != std::string::npos);

  // By default what lies still is solved at once, and sinks in by next to nothing.
  scene.settings.solver = WorldSettings{}.solver;
  SceneRun by_default(scene);
  Explanation at_rest(by_default);
  for (int tick = 0; tick < 300; ++tick) at_rest.step(here);
  REQUIRE(at_rest.choices().size() == 1);
  CHECK(at_rest.choices().front().sub_steps == 1);
  CHECK(at_rest.choices().front().sag_m > 0);
  CHECK(at_rest.choices().front().sag_m < 1e-6);
  CHECK(to_text(at_rest, by_default, 300).find("1 sub-step: groups at rest") != std::string::npos);

  scene.settings.solver = "lcp";
  SceneRun by_lcp(scene);
  Explanation other(by_lcp);
  for (int tick = 0; tick < 60; ++tick) other.step(here);
  CHECK(other.choices().front().sub_steps == 1);
  CHECK(to_text(other, by_lcp, 60).find("contact solver lcp: sub-steps are its own, up to 1 in") !=
        std::string::npos);
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
