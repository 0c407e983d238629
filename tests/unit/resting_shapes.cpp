// Every convex shape comes to rest on the ground, where geometry says.
#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "server/collision/geometry.h"
#include "server/scene.h"
#include "server/simulate.h"

using namespace cradle;

namespace {

/// A state of rest: the height of Bo over the ground, and the cosine between z of the body and up.
struct Rest {
  double height_m, cosine;
};

}  // namespace

TEST_CASE("every convex shape comes to rest on the ground at its height and tilt") {
  SerialExecutor here;
  SceneRun run(load_scene(CRADLE_SCENE_DIR "/shapes.toml"));
  for (int tick = 0; tick < 1200; ++tick) run.step(here);

  // A cone on its side: its axis rises from the ground by the angle whose tangent is r / (2 h).
  const double slope = std::atan2(0.3, 0.8);
  const std::map<std::string, Rest> expected = {
      {"sphere", {0.3, 1}},
      {"box flat", {0.1, 1}},
      {"capsule lying", {0.2, 0}},
      {"cylinder standing", {0.2, 1}},
      {"cylinder lying", {0.2, 0}},
      {"cone standing", {0.25, 1}},
      {"cone lying", {0.15 * std::cos(slope), -std::sin(slope)}},
      {"ellipsoid flat", {0.15, 1}},
      {"hull flat", {0.3, 1}},
  };
  // The contacts sag by g / omega^2, omega = 267 1/s (README, limits), and at one end by up to
  // thrice that if the load is not shared alike, as that of the lying cone.
  const double sag_m = 9.81 / (267.0 * 267.0);
  std::size_t seen = 0;
  for (const Event& event : run.world().describe({}, 100)) {
    const auto rest = expected.find(std::string(event.name));
    if (rest == expected.end()) continue;
    ++seen;
    CAPTURE(event.name);
    BodyState s;
    REQUIRE(run.world().find(event.body, s));
    const double cosine = to_eigen(s.q_WB).toRotationMatrix()(2, 2);
    CHECK(s.p_WBo.z < rest->second.height_m);
    CHECK(s.p_WBo.z > rest->second.height_m - 3 * sag_m);
    CHECK(std::abs(cosine - rest->second.cosine) < 1e-3);
    CHECK(to_eigen(s.v_WBcm).norm() < 1e-6);
    CHECK(to_eigen(s.w_WB).norm() < 1e-5);
  }
  CHECK(seen == expected.size());
  CHECK(run.world().not_colliding_count() == 0);
}

TEST_CASE("in the scene of compounds all come to rest on the table and on the ground") {
  SerialExecutor here;
  SceneRun run(load_scene(CRADLE_SCENE_DIR "/compounds.toml"));
  for (int tick = 0; tick < 900; ++tick) run.step(here);
  // The height of Bo. The hammer lies on its heavy head alone.
  const std::map<std::string, double> expected = {
      {"table", 0}, {"stool", 0.8}, {"hammer", 0.86}, {"dumbbell", 0.25}};
  for (const Event& event : run.world().describe({}, 100)) {
    const auto height = expected.find(std::string(event.name));
    if (height == expected.end()) continue;
    CAPTURE(event.name);
    BodyState s;
    REQUIRE(run.world().find(event.body, s));
    CHECK(s.p_WBo.z == Approx(height->second).margin(6e-3));
  }
}

TEST_CASE("in the scene of dominoes all fall, and the wedge ends in the bin") {
  SerialExecutor here;
  SceneRun run(load_scene(CRADLE_SCENE_DIR "/dominoes.toml"));
  for (int tick = 0; tick < 480; ++tick) run.step(here);
  int dominoes = 0, in_bin = 0;
  for (const Event& event : run.world().describe({}, 100)) {
    CAPTURE(event.body.value);
    BodyState s;
    REQUIRE(run.world().find(event.body, s));
    if (event.name == "wedge") CHECK(std::abs(s.p_WBo.x - 6) < 1.2);
    if (event.name == "wedge") CHECK(s.p_WBo.y < 2);
    if (event.body_kind != BodyKind::dynamic || !event.name.empty()) continue;
    if (event.shape == Shape::box({0.06, 0.5, 0.5})) {
      CHECK(s.q_WB.z < -0.55);  // leaning on the next by more than 67 degrees, or flat
      ++dominoes;
    } else {
      CHECK(std::abs(s.p_WBo.x - 6) < 1.2);
      CHECK(std::abs(s.p_WBo.y - 0.7) < 0.7);
      ++in_bin;
    }
  }
  CHECK(dominoes == 12);
  CHECK(in_bin == 16);
}
