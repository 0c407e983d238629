// Pairs of boxes around bodies that meet by their corners alone are no pairs: what could touch
// within the tick is never among them.
#include <catch2/catch.hpp>

#include "server/collision/bounds.h"
#include "server/collision/narrow_phase.h"
#include "tests/physics/flock.h"
#include "tests/physics/worlds.h"

using namespace cradle;

namespace {

/// As wide as long: the others have boxes that tell more than their balls do.
Shape random_shape(std::mt19937_64& random) {
  const double size = uniform(random, 0.4, 0.6);
  switch (random() % 3) {
    case 0:
      return Shape::box({size, size, size});
    case 1:
      return Shape::cylinder(size, size);
    default:
      return Shape::ellipsoid({size, 0.9 * size, size});
  }
}

BodySpec thrown(std::mt19937_64& random, const Vector& x, double speed_mps) {
  BodySpec spec;
  spec.shape = random_shape(random);
  spec.p_WBo = {x.x(), x.y(), x.z()};
  const Rotation q(Eigen::AngleAxisd(uniform(random, 0, 3), random_axis(random).normalized()));
  spec.q_WB = {q.w(), q.x(), q.y(), q.z()};
  const Vector v = speed_mps * random_axis(random).normalized();
  spec.v_WBcm = {v.x(), v.y(), v.z()};
  return spec;
}

/// After `t` seconds, if nothing turns it.
Pose pose_of(const BodySpec& spec, double t = 0) {
  return {to_eigen(spec.p_WBo) + t * to_eigen(spec.v_WBcm), to_eigen(spec.q_WB).toRotationMatrix()};
}

bool pairs_meet(const BodySpec& a, const BodySpec& b) {
  for (const double part : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const double t = part / 60;
    if (collide(a.shape, pose_of(a, t), b.shape, pose_of(b, t), 2e-3).count > 0) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("what could touch within the tick is a pair, whatever way it comes") {
  std::mt19937_64 random(3);
  int near = 0, culled_by_balls = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const double speed_mps = std::pow(10, uniform(random, -1, 1.5));
    const BodySpec a = thrown(random, Vector::Zero(), speed_mps);
    const BodySpec b =
        thrown(random, uniform(random, 1, 2.5) * random_axis(random).normalized(), speed_mps);
    World world(settings());
    add(world, a);
    add(world, b);
    const bool may_touch = pairs_meet(a, b);
    const std::int64_t pairs = world.step().pairs;
    near += may_touch ? 1 : 0;
    const bool boxes_meet = bounds({a.shape, pose_of(a)}).overlaps(bounds({b.shape, pose_of(b)}));
    culled_by_balls += pairs == 0 && boxes_meet ? 1 : 0;
    CAPTURE(trial, speed_mps);
    REQUIRE((!may_touch || pairs == 1));
  }
  CHECK(near > 500);
  CHECK(culled_by_balls > 100);
}
