// Materials over the wire: a real client's balls and blocks, in a real daemon's world.
#include <catch2/catch.hpp>
#include <map>

#include "tests/integration/daemon.h"

namespace cradle {

TEST_CASE("a client's materials decide how its bodies roll, spin, slide and bounce") {
  const Process daemon(serve_arguments());
  const auto client = connect();
  REQUIRE(client);
  const auto spawn = [&](const BodySpec& spec) {
    const Answer answer = client->wait(client->spawn(spec), std::chrono::seconds(20));
    CHECK(answer);
    return answer.body;
  };
  BodySpec floor;
  floor.kind = BodyKind::fixed;
  floor.shape = Shape::half_space();
  floor.material.friction = 0.9;
  spawn(floor);

  // The rolling ball of P40 stops after 0.178 m, the spinning one within 4 s; the block has no
  // friction with this floor by the minimum, and stops by default.
  BodySpec rolls;
  rolls.shape = Shape::sphere(0.5);
  rolls.mass_kg = 1;
  rolls.p_WBo = {0, 0, 0.5};
  rolls.v_WBcm = {1, 0, 0};
  rolls.w_WB = {0, 2, 0};
  rolls.material.rolling_friction_m = 0.2;
  BodySpec spins = rolls;
  spins.p_WBo = {0, 5, 0.5};
  spins.v_WBcm = {};
  spins.w_WB = {0, 0, 1};
  spins.material.rolling_friction_m = 0;
  spins.material.torsional_friction_m = 0.2;
  BodySpec slides;
  slides.shape = Shape::box({0.5, 0.5, 0.1});
  slides.mass_kg = 1;
  slides.p_WBo = {0, 10, 0.1};
  slides.v_WBcm = {1, 0, 0};
  slides.material.friction = 0;
  slides.material.friction_rule = CombineRule::minimum;
  BodySpec rubs = slides;
  rubs.p_WBo.y = 15;
  rubs.material.friction_rule = CombineRule::average;
  BodySpec lies;
  lies.shape = Shape::sphere(0.5);
  lies.mass_kg = 1;
  lies.p_WBo = {0, 20, 1};
  lies.material.restitution = 1;
  lies.material.restitution_rule = CombineRule::multiply;
  BodySpec bounces = lies;
  bounces.p_WBo.y = 25;
  bounces.material.restitution_rule = CombineRule::by_default;

  std::map<std::string, BodyId> ids;
  ids["rolls"] = spawn(rolls);
  ids["spins"] = spawn(spins);
  ids["slides"] = spawn(slides);
  ids["rubs"] = spawn(rubs);
  ids["lies"] = spawn(lies);
  ids["bounces"] = spawn(bounces);
  const auto state = [&](const std::string& name) {
    const BodyView* view = client->find(ids.at(name));
    return view != nullptr ? view->state : BodyState{};
  };

  REQUIRE(poll_until(*client, [&] { return state("slides").p_WBo.x > 4; }));  // 4 s
  REQUIRE(poll_until(*client, [&] { return state("bounces").p_WBo.z > 0.9; }));
  CHECK(state("rolls").p_WBo.x == Approx(0.178389).epsilon(1e-3));
  CHECK(std::abs(state("rolls").w_WB.y) < 1e-3);
  CHECK(std::abs(state("spins").w_WB.z) < 1e-3);
  CHECK(state("slides").v_WBcm.x == Approx(1).epsilon(1e-9));
  CHECK(state("rubs").p_WBo.x == Approx(0.5 / (0.45 * 9.81)).epsilon(0.02));
  CHECK(std::abs(state("lies").p_WBo.z - 0.5) < 1e-3);

  BodySpec bad = rolls;
  bad.material.rolling_friction_m = -1;
  CHECK(client->wait(client->spawn(bad), std::chrono::seconds(20)).result == Result::out_of_range);
}

TEST_CASE("a client says how deep a body may sink in, unless sub-steps are fixed") {
  const auto spawn_on_floor = [](Client& client, double tolerance_m) {
    BodySpec floor;
    floor.kind = BodyKind::fixed;
    floor.shape = Shape::half_space();
    CHECK(client.wait(client.spawn(floor), std::chrono::seconds(20)));
    BodySpec lies;
    lies.shape = Shape::box({0.5, 0.5, 0.5});
    lies.p_WBo = {0, 0, 0.501};  // it falls: what lies there from the start does not sink in
    lies.contact_tolerance_m = tolerance_m;
    return client.wait(client.spawn(lies), std::chrono::seconds(20));
  };
  {
    // The sag law (Catto 2024): g / omega^2 is 0.14 mm at four sub-steps, 4e-6 m at 24.
    const Process daemon(serve_arguments());
    const auto client = connect();
    REQUIRE(client);
    const Answer answer = spawn_on_floor(*client, 1e-5);
    REQUIRE(answer);
    const auto sag = [&] {
      const BodyView* view = client->find(answer.body);
      return view != nullptr ? 0.5 - view->state.p_WBo.z : 0.0;
    };
    REQUIRE(poll_until(*client, [&] { return sag() > 3e-6; }));
    CHECK(sag() < 1.01e-5);
    CHECK(spawn_on_floor(*client, 1e-12).result == Result::out_of_range);
  }
  const Process daemon(
      serve_arguments({"--scene", CRADLE_SCENE_DIR "/compounds.toml"}));  // with eight
  const auto client = connect();
  REQUIRE(client);
  CHECK(spawn_on_floor(*client, 1e-5).result == Result::not_allowed);
}

}  // namespace cradle
