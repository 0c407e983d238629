// P42: what moves in a plane moves alike in a planar world and in space, where nothing drives it
// out of the plane; and what planar worlds alone promise.
#include <catch2/catch.hpp>
#include <random>

#include "server/collision/machine_lanes.h"
#include "tests/physics/planar.h"

namespace cradle {
namespace {

/// The same bodies and commands in the plane and in space.
struct PlanarTwins {
  World planar, spatial;
  explicit PlanarTwins(const Vec3& gravity_W, double rate_hz = 60)
      : planar(planar_settings(gravity_W, rate_hz)), spatial(settings(rate_hz, gravity_W)) {}

  BodyId add(const BodySpec& spec) {
    const Outcome one = planar.spawn(std::array{spec});
    const Outcome other = spatial.spawn(std::array{spec});
    REQUIRE(one.result == Result::ok);
    REQUIRE(one.body == other.body);
    return one.body;
  }
  template <class F>
  void both(F&& f) {
    REQUIRE(f(planar).result == Result::ok);
    REQUIRE(f(spatial).result == Result::ok);
  }
  void push(const Wrench& wrench) {
    both([&](World& world) { return world.push(std::array{wrench}); });
  }
  void step(int count = 1) {
    steps(planar, count);
    steps(spatial, count);
  }

  /// Largest difference of all bodies: m, rad, m/s and rad/s alike.
  double difference() const {
    std::vector<BodyState> a, b;
    planar.snapshot(a);
    spatial.snapshot(b);
    double largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      for (const double one :
           {distance(a[i].p_WBo, b[i].p_WBo), turn_between(a[i].q_WB, b[i].q_WB),
            distance(a[i].v_WBcm, b[i].v_WBcm), distance(a[i].w_WB, b[i].w_WB)}) {
        largest = std::isfinite(one) ? std::fmax(largest, one) : INFINITY;
      }
    }
    return largest;
  }
};

}  // namespace

TEST_CASE("P42: free flight in the plane is that in space, to 1e-9") {
  std::mt19937_64 random(42);
  PlanarTwins twins({0.5, -9.81, 0});
  std::vector<BodyId> bodies;
  for (int i = 0; i < 200; ++i) bodies.push_back(twins.add(random_planar_body(random)));
  for (const BodyId body : bodies) {
    if (random() % 2 == 0) twins.push(random_planar_wrench(random, body));
    if (random() % 4 != 0) continue;
    const Drag drag{uniform(random, 0, 1), uniform(random, 0, 0.3), uniform(random, 0, 0.1)};
    twins.both([&](World& world) { return world.set_drag(body, drag); });
  }
  double worst = 0;
  for (int tick = 0; tick < 300; ++tick) {
    twins.step();
    worst = std::fmax(worst, twins.difference());
  }
  INFO(worst);
  CHECK(worst < 1e-9);
  CHECK(twins.planar.quarantined_count() == 0);
}

TEST_CASE("P42: springs in the plane are those in space, to 1e-9") {
  std::mt19937_64 random(43);
  PlanarTwins twins({0, -9.81, 0});
  std::vector<BodyId> bodies;
  std::vector<Vec3> centres;
  for (int i = 0; i < 40; ++i) {
    BodySpec spec = random_planar_body(random);
    spec.shape = {};  // nothing touches
    if (spec.inertia_kgm2 == Vec3{}) spec.inertia_kgm2 = {0.2, 0.3, 0.4};
    spec.p_WBo = {uniform(random, -4, 4), uniform(random, -4, 4), 0};
    spec.w_WB.z = std::fmod(spec.w_WB.z, 5);
    bodies.push_back(twins.add(spec));
    centres.push_back(spec.p_BoBcm);
  }
  for (std::size_t i = 0; i + 1 < bodies.size(); ++i) {
    Spring spring;
    spring.a = bodies[i];
    if (random() % 3 != 0) spring.b = bodies[i + 1];
    spring.stiffness = uniform(random, 1, 50);
    spring.damping = uniform(random, 0, 2);
    // One without rest length is damped, far below what this sees, by the mass that it moves in all
    // three directions: in the plane another one, unless the spring has no arm.
    if (random() % 2 == 0) {
      spring.point_a = centres[i];
      if (spring.b) spring.point_b = centres[i + 1];
    } else {
      spring.rest_length = uniform(random, 0.5, 2);
      spring.point_a = {uniform(random, -0.2, 0.2), uniform(random, -0.2, 0.2), 0};
      spring.point_b = {uniform(random, -0.2, 0.2), uniform(random, -0.2, 0.2), 0};
    }
    twins.both([&](World& world) { return world.add_springs(std::array{spring}); });
  }
  twins.step(120);
  CHECK(twins.difference() < 1e-9);
}

TEST_CASE("P42: every scheme moves bodies in the plane as in space, to 1e-9") {
  for (const std::string& scheme : scheme_names()) {
    CAPTURE(scheme);
    std::mt19937_64 random(44);
    PlanarTwins twins({0, -9.81, 0});
    WorldSettings told = planar_settings({0, -9.81, 0});
    told.scheme = scheme;
    twins.planar = World(told);
    told.is_planar = false;
    twins.spatial = World(told);
    for (int i = 0; i < 30; ++i) {
      BodySpec spec = random_planar_body(random);
      spec.w_WB.z = std::fmod(spec.w_WB.z, 5);
      const BodyId body = twins.add(spec);
      twins.both([&](World& world) { return world.set_drag(body, {0.3, 0.1, 0.02}); });
    }
    twins.step(120);
    CHECK(twins.difference() < 1e-9);
  }
}

TEST_CASE("in the plane a constant torque turns by a quadratic angle, at any speed") {
  // J about z 0.5 kg m^2, 250 N m: 4 rad in the first second, and 50 rad a tick after a minute.
  for (const double torque : {4.0, 250.0}) {
    for (const double w0 : {0.0, -3.0}) {
      World world(planar_settings({}));
      BodySpec spec;
      spec.mass_kg = 2;
      spec.inertia_kgm2 = {0.3, 0.4, 0.5};
      spec.w_WB = {0, 0, w0};
      Wrench twist;
      twist.body = add(world, spec);
      twist.quantity = WrenchQuantity::torque;
      twist.frame = torque > 100 ? WrenchFrame::body : WrenchFrame::world;
      twist.value = {0, 0, torque};
      twist.duration = WrenchDuration::until_cleared;
      REQUIRE(world.push(std::array{twist}).result == Result::ok);
      steps(world, 600);
      const double t = 10, phi = w0 * t + torque / 0.5 * t * t / 2;
      const BodyState s = state(world, twist.body);
      CHECK(s.w_WB.z == Approx(w0 + torque / 0.5 * t).epsilon(1e-13));
      CHECK(turn_between(s.q_WB, about_z(phi)) < 1e-12 * std::fmax(1, std::abs(phi)));
    }
  }
}

TEST_CASE("the fastest spin allowed turns by its angle in the plane") {
  World world(planar_settings({}, 1));
  BodySpec spec;
  spec.mass_kg = 1;
  spec.inertia_kgm2 = {1, 1, 1};
  spec.w_WB = {0, 0, 1e5};
  const BodyId body = add(world, spec);
  steps(world, 3);
  CHECK(turn_between(state(world, body).q_WB, about_z(std::fmod(3e5, 4 * M_PI))) < 1e-9);
  CHECK(std::abs(norm_of(state(world, body).q_WB) - 1) < 1e-15);
}

TEST_CASE("a planar world has the same hash at every width") {
  std::vector<std::array<std::uint8_t, 8>> hashes;
  for (const int lanes : machine_lanes()) {
    std::mt19937_64 random(45);
    WorldSettings told = planar_settings({0, -9.81, 0});
    told.lanes = lanes;
    World world(told);
    for (int i = 0; i < 403; ++i) {
      BodySpec spec = random_planar_body(random);
      spec.shape = {};  // nothing touches
      spec.sets_centre_of_mass = false, spec.p_BoBcm = {};
      spec.inertia_products_kgm2 = {};
      spec.inertia_kgm2 = i % 9 == 0 ? Vec3{} : Vec3{0.3, 0.4, 0.5};
      if (i > 100 && i < 200) spec.w_WB = {};
      if (i % 50 == 0) spec.kind = BodyKind::kinematic;
      const BodyId body = add(world, spec);
      REQUIRE(body.value == i + 1);
      if (i < 200 || spec.kind != BodyKind::dynamic || random() % 3 != 0) continue;
      REQUIRE(world.push(std::array{random_planar_wrench(random, body)}).result == Result::ok);
    }
    steps(world, 100);
    hashes.push_back(world.hash());
    CHECK(hashes.back() == hashes.front());
  }
  CHECK(hashes.size() >= 2);
}

TEST_CASE("that a world is planar is part of its hash") {
  CHECK(World(planar_settings({})).hash() != World(weightless()).hash());
}

TEST_CASE("nothing ever leaves the plane") {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    CAPTURE(seed);
    std::mt19937_64 random(seed);
    WorldSettings told = planar_settings({uniform(random, -2, 2), -9.81, 0});
    const std::vector<std::string> schemes = scheme_names();
    told.scheme = schemes[random() % schemes.size()];
    World world(told);
    add(world, level(0));
    std::vector<BodyId> bodies;
    for (int i = 0; i < 25; ++i) {
      BodySpec spec = random_planar_body(random);
      spec.p_WBo = {uniform(random, -4, 4), uniform(random, 0, 6), 0};
      spec.material = {uniform(random, 0, 1), uniform(random, 0, 1)};
      if (random() % 4 == 0) spec.w_WB.z = uniform(random, -2000, 2000);
      if (random() % 8 == 0) spec.kind = BodyKind::kinematic, spec.mass_kg = 0;
      const BodyId body = add(world, spec);
      REQUIRE(body);
      if (spec.kind != BodyKind::dynamic) continue;
      bodies.push_back(body);
      if (random() % 3 == 0) world.push(std::array{random_planar_wrench(random, body)});
      if (random() % 4 == 0) world.set_drag(body, {0.2, 0.05, 0.01});
      if (random() % 4 == 0 && bodies.size() > 1) {
        Spring spring{bodies[bodies.size() - 2], body, {0.1, 0, 0}, {0, -0.1, 0}, 40, 1, 0.5};
        REQUIRE(world.add_springs(std::array{spring}).result == Result::ok);
      }
    }
    std::vector<BodyState> states;
    int contacts = 0;
    for (int tick = 0; tick < 120; ++tick) {
      contacts += world.step().contacts;
      world.snapshot(states);
      for (const BodyState& s : states) {
        if (s.body.value == 1) continue;  // the half-space
        REQUIRE(is_in_plane(s));
      }
    }
    CHECK(contacts > 0);
  }
}

}  // namespace cradle
