// Rotation vectors against Eigen's angle and axis.
#include "server/collision/turn.h"

#include <catch2/catch.hpp>
#include <numbers>

#include "tests/unit/collision_pairs.h"

namespace cradle {

TEST_CASE("a rotation vector and its rotation give each other") {
  Random random(3);
  for (int k = 0; k < 2000; ++k) {
    const double angle = k % 10 == 0 ? 1e-9 * k : random.uniform(0, std::numbers::pi);
    const Vector axis = random.direction();
    const Rotation q(Eigen::AngleAxisd(angle, axis));
    const Rotation minus(-q.w(), -q.x(), -q.y(), -q.z());
    CAPTURE(k, angle);
    REQUIRE((rotation_log(q) - angle * axis).norm() < 1e-14);
    REQUIRE((rotation_log(minus) - angle * axis).norm() < 1e-14);
    const double turns = random.uniform(0, 30);
    const Rotation many(Eigen::AngleAxisd(turns, axis));
    REQUIRE((rotation_exp(turns * axis).toRotationMatrix() - many.toRotationMatrix()).norm() <
            1e-13);
  }
}

}  // namespace cradle
