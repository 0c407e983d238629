// Boxes that meet by edges or corners tell what else of their faces is near.
#include <algorithm>
#include <catch2/catch.hpp>
#include <span>
#include <utility>

#include "server/collision/narrow_phase.h"
#include "tests/unit/collision_support.h"

using namespace cradle;

namespace {

std::span<const ContactPoint> used(const Manifold& manifold) {
  return std::span(manifold.points).first(static_cast<std::size_t>(manifold.count));
}

double nearest(const Manifold& manifold) {
  return std::ranges::min(used(manifold), {}, &ContactPoint::separation).separation;
}

}  // namespace

TEST_CASE("faces that are about to slam together are foreseen") {
  // The edge of the upper cube over y = 0 crosses that of the lower one over x = 0.5, and is
  // nearest there. So steep is its lower face, upward along -x and y.
  const auto upper = [](double slope_x, double slope_y) {
    const Vector x = Vector(1, 0, -slope_x).normalized();
    const Vector z = x.cross(Vector(0, 1, slope_y)).normalized();
    Matrix R;
    R << x, z.cross(x), z;
    const Vector lowest = Vector(0.5, 0, 0.501);  // on both edges but for a millimetre
    return Pose{lowest - R * Vector(0, -0.5, -0.5), R};
  };
  for (const auto& [a, b] : {std::pair(0.1, 0.1), std::pair(0.05, 0.15), std::pair(0.2, 0.02)}) {
    CAPTURE(a, b);
    const Pose X_WB = upper(a, b);
    const Manifold near = collide(kCube, {}, kCube, X_WB, 0.01);
    REQUIRE(near.count == 1);
    const double s = near.points[0].separation;
    // With the margin of a fast turn, the corners of the area where they overlap from above.
    const Manifold all = collide(kCube, {}, kCube, X_WB, 0.3);
    CHECK((all.normal_W - near.normal_W).norm() < 1e-12);
    CHECK(std::abs(nearest(all) - s) < 1e-12);
    REQUIRE(all.count == 4);
    // Others are midway between both faces along the normal of one, and as far apart along n.
    const Vector axis_B = X_WB.R.col(2), &n = all.normal_W;
    const auto is_between = [&](const ContactPoint& point, const Vector& face) {
      const Vector half = 0.5 * point.separation / n.dot(face) * face;
      const Vector on_A = point.p_W - half, on_B = X_WB.R.transpose() * (point.p_W + half - X_WB.x);
      return std::abs(on_A.z() - 0.5) < 1e-12 && std::abs(on_B.z() + 0.5) < 1e-12 &&
             on_A.cwiseAbs().maxCoeff() < 0.5 + 1e-12 && on_B.cwiseAbs().maxCoeff() < 0.5 + 1e-12;
    };
    for (const ContactPoint& point : used(all)) {
      const double way = (point.p_W - near.points[0].p_W).norm();
      if (way < 1e-12) continue;
      CHECK(way > 0.4);
      CHECK((is_between(point, Vector::UnitZ()) || is_between(point, axis_B)));
    }
    // What is too far away for the margin is not among them.
    CHECK(collide(kCube, {}, kCube, X_WB, 0.04).count < 4);
  }
}
