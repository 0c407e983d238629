// Boxes that turn about the edge or corner where they touch, until their faces meet.
#include <algorithm>
#include <catch2/catch.hpp>
#include <utility>

#include "tests/physics/worlds.h"

using namespace cradle;

TEST_CASE("a cube that turns about an edge it touches puts its face down, not in") {
  // Upright but for its slopes along -x and y, over a quarter of the lower cube's top, where edges
  // cross. It turns by up to 0.23 rad in a tick, by 0.1 rad more than to lie flat.
  for (const auto& [slope_x, slope_y] : {std::pair(0.1, 0.1), std::pair(0.12, 0.04)}) {
    World world(weightless());
    BodySpec lower = brick({0.5, 0.5, 0.5}, {});
    lower.kind = BodyKind::fixed;
    add(world, lower);
    BodySpec upper = brick({0.5, 0.5, 0.5}, {});
    const Vector x = Vector(1, 0, -slope_x).normalized();
    const Vector z = x.cross(Vector(0, 1, slope_y)).normalized();
    Matrix R;
    R << x, z.cross(x), z;
    const Vector arm = R * Vector(0, 0.5, 0.5);  // from the middle of its edge over y = 0
    upper.p_WBo = to_plain(Vector(0.5, 0, 0.502) + arm);
    upper.q_WB = to_plain(Rotation(R));
    const Vector level = z.cross(Vector::UnitZ());
    const Vector w = 60 * (level.norm() + 0.1) * level.normalized();
    upper.w_WB = to_plain(w);
    upper.v_WBcm = to_plain(w.cross(arm));
    const BodyId body = add(world, upper);
    world.step();
    const BodyState s = state(world, body);
    const Matrix R_now = to_eigen(s.q_WB).toRotationMatrix();
    double lowest = 1;
    for (const Vector& corner : {Vector(-0.5, -0.5, -0.5), Vector(-0.5, 0.5, -0.5)}) {
      const Vector p = to_eigen(s.p_WBo) + R_now * corner;
      if (p.x() < 0.5 && p.y() < 0.5) lowest = std::min(lowest, p.z() - 0.5);
    }
    CAPTURE(slope_x, slope_y);
    CHECK(lowest > -0.01);
    CHECK(lowest < 0.05);
  }
}
