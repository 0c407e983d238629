// A million points, refused with a reason or handled, in memory in proportion to them. How long it
// takes is bounded by ctest's timeout alone.
#include <sys/resource.h>

#include "server/dynamics/mass_distribution.h"
#include "tests/unit/collision_pairs.h"

using namespace cradle;

namespace {

constexpr int kMillion = 1'000'000;

/// The most memory that this process has ever had, bytes.
std::size_t peak_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024 * static_cast<std::size_t>(usage.ru_maxrss);
}

std::vector<Vector> plane_of_points(double thickness) {
  Random random(91);
  std::vector<Vector> points;
  for (int k = 0; k < kMillion; ++k)
    points.emplace_back(random.uniform(-1, 1), random.uniform(-1, 1),
                        random.uniform(0, 1) * thickness);
  return points;
}

}  // namespace

TEST_CASE("a million points in a plane have no hull, level or turned") {
  const std::string wanted =
      "; a hull must be wider than 1e-4 m in every direction, and than 1e-7 of its length";
  std::vector<Vector> points = plane_of_points(0);
  CHECK(make_hull(points).fault == "the points are all in one plane" + wanted);
  const Matrix turn = Random(92).rotation();
  for (Vector& p : points) p = turn * p + Vector(100, 200, 300);
  CHECK(make_hull(points).fault == "the points are all in one plane" + wanted);
  for (Vector& p : points) p = Vector(p.x(), 2 * p.x(), 3 * p.x());
  CHECK(make_hull(points).fault == "the points are all on one line" + wanted);
}

TEST_CASE("a needle whose moments rounding would swallow is no hull") {
  // 1 mm wide: of 10 km its least moment is 1e-14 of the largest; of 1 km it is still told.
  for (const double length : {1e3, 2e4}) {
    std::vector<Vector> points;
    for (int k = 0; k < 8; ++k) {
      points.emplace_back(k & 1 ? length : 0, k & 2 ? 1e-3 : 0, k & 4 ? 1e-3 : 0);
    }
    const MadeGeometry made = make_hull(points);
    CAPTURE(length);
    REQUIRE((made.geometry != nullptr) == (length < 1e4));
    if (!made.geometry) continue;
    const Vector gyration2 = mass_distribution(*made.geometry, 1).G.diagonal();
    CHECK(gyration2.x() == Approx(2 * 1e-6 / 12).epsilon(1e-3));
  }
}

TEST_CASE("a million points on the sides of a box are the box") {
  std::vector<Vector> points = plane_of_points(0);
  for (std::size_t k = 0; k < points.size(); ++k) {
    points[k].z() = k % 2 == 0 ? 1 : -1;
    if (k % 3 > 0) std::swap(points[k].z(), points[k][k % 3 - 1]);
  }
  for (int k = 0; k < 8; ++k) points.emplace_back(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
  const std::size_t before = peak_bytes();
  const MadeGeometry made = make_hull(points);
  REQUIRE(made.geometry);
  const auto& hull = std::get<ConvexHull>(made.geometry->value);
  CHECK(hull.vertices.size() == 8);
  CHECK(hull.face_count() == 6);
  CHECK(mass_distribution(*made.geometry, 1).mass_kg == Approx(8));
  CHECK(peak_bytes() - before < 1'000'000'000);
}

TEST_CASE("a mesh of a million vertices is taken, refused if it is torn, and has its mass") {
  // A ball of rings and poles.
  constexpr int kRings = 1000, kSides = 1000;
  std::vector<Vector> vertices;
  std::vector<Triangle> triangles;
  for (int i = 0; i < kRings; ++i) {
    const double v = M_PI * (i + 1) / (kRings + 1);
    for (int j = 0; j < kSides; ++j) {
      const double u = 2 * M_PI * j / kSides;
      vertices.emplace_back(std::sin(v) * std::cos(u), std::sin(v) * std::sin(u), std::cos(v));
    }
  }
  const auto at = [](int i, int j) { return i * kSides + j % kSides; };
  const std::int32_t top = kRings * kSides, bottom = top + 1;
  vertices.emplace_back(0, 0, 1);
  vertices.emplace_back(0, 0, -1);
  for (int j = 0; j < kSides; ++j) {
    triangles.push_back({top, at(0, j), at(0, j + 1)});
    triangles.push_back({bottom, at(kRings - 1, j + 1), at(kRings - 1, j)});
    for (int i = 0; i + 1 < kRings; ++i) {
      triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  const std::size_t before = peak_bytes();
  const MadeGeometry made = make_mesh(vertices, triangles);
  REQUIRE(made.geometry);
  CHECK(std::get<TriangleMesh>(made.geometry->value).is_closed);
  CHECK(mass_distribution(*made.geometry, 1).mass_kg == Approx(4 * M_PI / 3).epsilon(1e-5));
  CHECK(peak_bytes() - before < 1'000'000'000);

  std::swap(triangles[1'000'000][0], triangles[1'000'000][1]);
  CHECK(make_mesh(vertices, triangles).fault.find("disagree") != std::string::npos);
  triangles.erase(triangles.begin() + 1'000'000);
  const MadeGeometry open = make_mesh(vertices, triangles);
  REQUIRE(open.geometry);
  CHECK_FALSE(std::get<TriangleMesh>(open.geometry->value).is_closed);
}
