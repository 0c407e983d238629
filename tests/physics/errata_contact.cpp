// The errata of the seed paper (Rueth, "Rigid Body Physics", II.B, III and its omissions) that
// concern mass, collision and contact; those of motion are in errata.cpp. E5 (inertia about the
// centre of mass) is in mass.cpp, with every shape; E14 (restitution, friction, mass ratio, rest
// and fast bodies are missing) in contact.cpp.
#include <catch2/catch.hpp>

#include "server/collision/broad_phase.h"
#include "server/collision/narrow_phase.h"
#include "server/dynamics/rotation.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {}  // namespace

TEST_CASE("P02: a fall, and a fall under twice the acceleration") {
  // Drop from 10 m for 2 s; with and without a persistent acceleration of g more.
  for (const double more : {0.0, 9.81}) {
    World world(settings(60, {0, -kGravity, 0}));
    const BodyId body = add(world, brick({1, 1, 1}, {0, 10, 0}));
    Wrench push;
    push.body = body;
    push.quantity = WrenchQuantity::acceleration;
    push.duration = WrenchDuration::until_cleared;
    push.value = {0, -more, 0};
    if (more > 0) REQUIRE(world.push(std::array{push}).result == Result::ok);
    steps(world, 120);
    const BodyState end = state(world, body);
    CHECK(std::abs(end.v_WBcm.y + 2 * (kGravity + more)) < 1e-12);
    CHECK(std::abs(end.p_WBo.y - (10 - 2 * (kGravity + more))) < 1e-11);
  }
}

TEST_CASE("E10: the normal is that of the faces, not from centre to centre") {
  // Printed: F along r_ij / |r_ij|. A beam on a post far from the middle: centre to centre the
  // normal would lean by 80 degrees.
  const Shape beam = Shape::box({2, 0.1, 0.1}), post = Shape::box({0.1, 0.1, 0.5});
  for (const double turn : {0.0, 0.4, 1.3}) {
    const Matrix R = rotation_exp({0.2 * turn, 0.3, turn}).toRotationMatrix();
    const Pose of_post{{5, 6, 7}, R};
    const Pose of_beam{of_post.x + R * Vector(1.7, 0, 0.599), R};
    const Manifold manifold = collide(post, of_post, beam, of_beam, 0.02);
    REQUIRE(manifold.count == 4);
    CHECK(manifold.normal_W.dot(R.col(2)) > 1 - 1e-12);
    for (int k = 0; k < 4; ++k) {
      CHECK(manifold.points[static_cast<std::size_t>(k)].separation == Approx(-0.001));
    }
  }
}

TEST_CASE("E11: keeping bodies apart adds no energy to a stack") {
  // Printed: first move bodies apart, then compute velocities: h g of work a step.
  World world(settings());
  add(world, ground());
  for (int i = 0; i < 10; ++i) add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0.5 + i}));
  const double start = energy(world);
  double most = start;
  for (int i = 0; i < 600; ++i) {
    world.step();
    most = std::fmax(most, energy(world));
  }
  CHECK(most - start <= 1e-9 * start);
}

TEST_CASE("E12: pairs grow with the bodies at one density, and with their square where all meet") {
  // Printed: O(n^2) because of collision detection. It is the output that says.
  const auto count = [](int side, double pitch) {
    std::vector<Aabb> boxes;
    for (int i = 0; i < side * side * side; ++i) {
      const Vector x = pitch * Vector(i % side, i / side % side, i / (side * side));
      boxes.push_back({x, x + Vector::Ones()});
    }
    const std::vector<std::uint8_t> moves(boxes.size(), 1);
    std::vector<BodyPair> pairs;
    BroadPhaseInput input;
    input.boxes = boxes;
    input.moves = moves;
    input.renumbered = true;
    make_fcl_broad_phase()->find_pairs(input, pairs);
    return static_cast<double>(pairs.size());
  };
  for (const int side : {5, 10, 20}) {  // each meets the 13 neighbours before it, but for the rim
    const double inner = 13.0 * side * side * side;
    CHECK(count(side, 0.9) < inner);
    CHECK(count(side, 0.9) > inner * (1 - 3.0 / side));
  }
  CHECK(count(5, 0) == 125 * 124 / 2);
}

TEST_CASE("E13: a rod that slides where Painleve found no force stays finite and gains no energy") {
  // A slender rod at tan = 2 with mu = 2 above 4/3: the LCP on accelerations has no solution, that
  // on impulses has (Stewart 2000, "Rigid-body dynamics with friction and impact", section 3).
  for (const auto& [speed, rate_hz] :
       {std::pair{1.0, 60.0}, {5.0, 60.0}, {20.0, 60.0}, {20.0, 240.0}}) {
    CAPTURE(speed, rate_hz);
    World world(settings(rate_hz));
    add(world, ground(2));
    const double lean = std::atan(0.5);  // from upright
    const Vector half(0.01, 0.01, 0.5);
    BodySpec rod = brick(to_plain(half), {});
    rod.material.friction = 2;
    const Rotation q = rotation_exp({0, lean, 0});
    rod.q_WB = to_plain(q);
    rod.p_WBo = {0, 0, 0.5 * std::cos(lean) + 0.01 * std::sin(lean)};
    rod.v_WBcm = {-speed, 0, -0.1};
    add(world, rod);
    const double start = energy(world);
    for (int i = 0; i < 240; ++i) {
      world.step();
      REQUIRE(energy(world) <= start * (1 + 1e-6));
    }
    CHECK(world.quarantined_count() == 0);
  }
}

TEST_CASE("E15: spheres that touch exactly are in contact") {
  // Printed: R_i + R_j > |x_i - x_j|; a body at rest is on the edge of it.
  const Pose at_origin;
  for (const Vector& apart : {Vector(1, 0, 0), Vector(0, -1, 0), Vector(0.6, 0, 0.8)}) {
    const Manifold manifold =
        collide(Shape::sphere(0.5), at_origin, Shape::sphere(0.5), {apart, Matrix::Identity()}, 0);
    REQUIRE(manifold.count == 1);
    CHECK(std::abs(manifold.points[0].separation) < 1e-15);
  }
}

}  // namespace cradle
