// Boxes apart, against FCL's GJK distance. FCL runs in a child process: Debian's build keeps its
// asserts, and an oracle must not end the test program.
#include <fcl/narrowphase/distance.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <random>

#include "server/collision/narrow_phase.h"
#include "server/collision/tolerances.h"

using namespace cradle;

namespace {

constexpr double kOracle = 1e-6;  // m, what FCL's distance is good for

struct Boxes {
  Vector half_A, half_B;
  Pose X_WA, X_WB;
};

std::vector<Boxes> random_boxes(std::size_t count) {
  std::mt19937_64 engine(3);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine);
  };
  const auto vector = [&](double low, double high) {
    return Vector(uniform(low, high), uniform(low, high), uniform(low, high));
  };
  const auto rotation = [&] {
    return Eigen::AngleAxisd(uniform(0, 3), vector(-1, 1).normalized()).toRotationMatrix();
  };
  std::vector<Boxes> boxes(count);
  for (Boxes& b : boxes) {
    b = {vector(0.3, 1), vector(0.3, 1), {vector(-1, 1), rotation()}, {{0, 0, 0}, rotation()}};
    if (uniform(0, 1) < 0.3) b.X_WB.R = b.X_WA.R;  // faces, or edges, that are parallel
    const Vector direction = vector(-1, 1).normalized();
    const double touching = b.half_A.dot((b.X_WA.R.transpose() * direction).cwiseAbs()) +
                            b.half_B.dot((b.X_WB.R.transpose() * direction).cwiseAbs());
    b.X_WB.x = b.X_WA.x + direction * touching * uniform(0.7, 1.05);
  }
  return boxes;
}

double fcl_distance(const Boxes& boxes) {
  const auto shape = [](const Vector& half) { return fcl::Boxd(2 * half); };
  const auto pose = [](const Pose& X) {
    fcl::Transform3d T = fcl::Transform3d::Identity();
    T.linear() = X.R;
    T.translation() = X.x;
    return T;
  };
  const fcl::Boxd A = shape(boxes.half_A), B = shape(boxes.half_B);
  const fcl::DistanceRequestd request;  // unsigned
  fcl::DistanceResultd result;
  return fcl::distance(&A, pose(boxes.X_WA), &B, pose(boxes.X_WB), request, result);
}

/// Distances by FCL, -1 where the boxes overlap; found by a child process. Empty if it died.
std::vector<double> distances_by_child(const std::vector<Boxes>& boxes) {
  const std::size_t bytes = boxes.size() * sizeof(double);
  void* memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return {};
  auto* shared = static_cast<double*>(memory);
  const pid_t child = fork();
  if (child == 0) {
    std::transform(boxes.begin(), boxes.end(), shared, fcl_distance);
    _exit(0);
  }
  int status = -1;
  const bool ended = child > 0 && waitpid(child, &status, 0) == child && status == 0;
  const std::vector<double> distances(shared, shared + (ended ? boxes.size() : 0));
  munmap(memory, bytes);
  return distances;
}

}  // namespace

TEST_CASE("boxes apart are as far from each other as FCL says") {
  constexpr double kMargin = 0.05;
  const std::vector<Boxes> boxes = random_boxes(20000);
  const std::vector<double> distances = distances_by_child(boxes);
  REQUIRE(distances.size() == boxes.size());
  int near = 0, exact = 0, seen = 0, missed = 0;
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    CAPTURE(k);
    const Boxes& b = boxes[k];
    const double distance = distances[k];
    const Manifold manifold = collide(Shape::box(to_plain(b.half_A)), b.X_WA,
                                      Shape::box(to_plain(b.half_B)), b.X_WB, kMargin);
    double least = kMargin;
    for (int point = 0; point < manifold.count; ++point) {
      least = std::min(least, manifold.points[static_cast<std::size_t>(point)].separation);
    }
    if (distance < 0) {
      REQUIRE(manifold.count > 0);
      REQUIRE(least < kOracle);
      continue;
    }
    if (distance > kMargin + kOracle) REQUIRE(manifold.count == 0);
    if (distance < kMargin - kOracle) ++(manifold.count > 0 ? seen : missed);
    if (manifold.count == 0) continue;
    // No point claims more nearness than there is, but for a corner within the slack of a face.
    REQUIRE(least > distance - kTolerances.clip_slack_m);
    ++near;
    exact += std::abs(least - distance) < kOracle;
  }
  CAPTURE(near, exact);
  CHECK(near > 500);
  CHECK(missed < seen / 10);     // corners against edges and corners
  CHECK(exact > near * 9 / 10);  // else the closest feature was beside the preferred one
}
