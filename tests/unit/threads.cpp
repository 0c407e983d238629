// Whole worlds on one, two and four threads: the same bits, tick by tick.
#include <array>
#include <catch2/catch.hpp>
#include <memory>
#include <string>
#include <vector>

#include "server/simulate.h"
#include "server/thread_pool.h"

namespace cradle {
namespace {

/// What a scene is to bring into the passes that threads share.
struct Crowd {
  const char* scene;
  const char* solver;
  int ticks;
  bool is_sleeping;
};
constexpr Crowd kCrowds[] = {
    {"bench_gas", "soft", 20, false},            // balls that bounce, each at its time
    {"bench_pile", "soft", 130, false},          // islands of many kinds, then one in domains
    {"bench_pyramid", "soft", 40, false},        // one island at rest
    {"bench_large_pyramid", "soft", 4, false},   // one in four domains
    {"bench_pyramid", "hybrid", 30, false},      // which another method takes over
    {"bench_pyramid", "newton", 3, false},       //
    {"bench_terrain", "soft", 90, false},        // four shapes on a mesh
    {"bench_terrain", "hybrid", 70, false},      //
    {"bench_stack", "soft", 240, true},          // falls asleep
    {"bench_bouncing_balls", "soft", 60, true},  // impacts with restitution
};

using Hash = std::array<std::uint8_t, 8>;

std::vector<Hash> hashes(const Crowd& crowd, Executor& executor) {
  Scene scene = load_scene(CRADLE_SCENE_DIR "/" + std::string(crowd.scene) + ".toml");
  scene.settings.solver = crowd.solver;
  scene.settings.is_sleeping = crowd.is_sleeping;
  SceneRun run(std::move(scene));
  std::vector<Hash> all;
  for (int tick = 0; tick < crowd.ticks; ++tick) {
    run.step(executor);
    all.push_back(run.world().hash());
  }
  return all;
}

}  // namespace

TEST_CASE("a world goes the same way on one, two and four threads, to the bit") {
  for (const Crowd& crowd : kCrowds) {
    CAPTURE(crowd.scene, crowd.solver);
    SerialExecutor serial;
    const std::vector<Hash> alone = hashes(crowd, serial);
    for (const int threads : {2, 4}) {
      CAPTURE(threads);
      ThreadPool pool(threads);
      CHECK(hashes(crowd, pool) == alone);
    }
  }
}

}  // namespace cradle
