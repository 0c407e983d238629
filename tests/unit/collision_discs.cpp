// What lies on a disc, or just reaches over its rim: a log (a cylinder that lies), a plank, a drum.
#include <catch2/catch.hpp>

#include "tests/bench/random_poses.h"
#include "tests/bench/solids.h"

namespace cradle {
namespace {

/// Of the pair, turned as a whole by X_W: how far its points are outside of either body, at most.
double most_outside(const Pair& pair, const Manifold& m) {
  double most = 0;
  for (const ContactPoint& point : points(m)) {
    most = std::max(
        {most, outside(pair.A, pair.X_WA, point.p_W), outside(pair.B, pair.X_WB, point.p_W)});
  }
  return most;
}

/// Lying along x.
Matrix lying() {
  Matrix R;
  R << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  return R;
}

Matrix tilted(double angle, RandomPoses& random) {
  return Eigen::AngleAxisd(angle, random.direction()).toRotationMatrix();
}

}  // namespace

TEST_CASE("a log over a drum's rim touches where it is over the drum") {
  RandomPoses random(3);
  const double tilt = GENERATE(0.0, 1e-14, 1e-12, 1e-10, 1e-8);
  CAPTURE(tilt);
  for (int trial = 0; trial < 2000; ++trial) {
    const double R = random.uniform(0.1, 1), H = random.uniform(0.1, 1);
    const double r = random.uniform(0.1, 1), h = random.uniform(0.1, 2);
    const double depth = random.uniform(0, 0.01), y = random.uniform(-0.95, 0.95) * R;
    const double edge = std::sqrt(R * R - y * y);  // of the cap, along the log
    const double lap = random.uniform(0.01, trial % 2 ? 0.2 : 2) * std::min(edge, h);
    Pair pair{Shape::cylinder(R, H), Shape::cylinder(r, h), {}, {}};
    pair.X_WB = {Vector(edge - lap + h, y, H + r - depth), tilted(tilt, random) * lying()};
    const Manifold m = pair.collide(0.02);
    if (m.count == 0 || m.normal_W.z() < 0.999) continue;  // shallower by another way
    CAPTURE(R, H, r, h, y, lap, depth);
    CHECK(most_outside(pair, m) < 1e-2);  // the depth, at most
    // The part of the log's lowest line that is over the cap.
    double least = 10, most = -10;
    for (const ContactPoint& point : points(m)) {
      least = std::min(least, point.p_W.x());
      most = std::max(most, point.p_W.x());
      CHECK(point.p_W.y() == Approx(y).margin(1e-3));
    }
    CHECK(least == Approx(edge - lap).margin(2e-3 * (1 + R / edge)));  // the slack, along the log
    CHECK(most == Approx(std::min(edge, edge - lap + 2 * h)).margin(2e-3 * (1 + R / edge)));
  }
}

TEST_CASE("drums and planks that just reach over a level rim touch there") {
  RandomPoses random(4);
  int laps = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const double R = random.uniform(0.1, 1), r = random.uniform(0.1, 1);
    const Vector way =
        Eigen::AngleAxisd(random.uniform(0, 6.28), Vector::UnitZ()) * Vector::UnitX();
    const double lap = random.uniform(0.001, 0.1) * std::min(R, r);
    const Shape other = trial % 2 ? Shape::cylinder(r, 0.2) : Shape::box({r, 2 * r, 0.2});
    Pair pair{Shape::cylinder(R, 0.2), other, {}, {}};
    pair.X_WB.x = (R + r - lap) * way + Vector(0, 0, 0.4 - 1e-4);
    // A box reaches over the rim by its side, anywhere along that.
    pair.X_WB.R.col(0) = -way;
    pair.X_WB.R.col(2) = Vector::UnitZ();
    pair.X_WB.R.col(1) = pair.X_WB.R.col(2).cross(pair.X_WB.R.col(0));
    if (trial % 2 == 0) pair.X_WB.x += random.uniform(-1.8, 1.8) * r * pair.X_WB.R.col(1);
    const Matrix turn = random.rotation();
    pair.X_WA = {turn * pair.X_WA.x, turn * pair.X_WA.R};
    pair.X_WB = {turn * pair.X_WB.x, turn * pair.X_WB.R};
    const Manifold m = pair.collide(0.02);
    CAPTURE(trial, R, r, lap);
    REQUIRE(m.count > 0);
    if (std::abs(m.normal_W.dot(turn.col(2))) < 0.999) continue;
    ++laps;
    CHECK(most_outside(pair, m) < 1.5e-3);  // the slack
  }
  CHECK(laps > 3500);
}

}  // namespace cradle
