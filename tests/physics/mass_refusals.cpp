// What is no solid is refused, and told why.
#include <cradle/limits.h>

#include <catch2/catch.hpp>
#include <limits>

#include "tests/physics/solids.h"

namespace cradle {
namespace {

using Catch::Matchers::Contains;

Surface with(Surface a, const Surface& b) {
  const auto shift = static_cast<std::int32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const Triangle& t : b.triangles) {
    a.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  }
  return a;
}

Surface turned_round(Surface s) {
  for (Triangle& t : s.triangles) std::swap(t[1], t[2]);
  return s;
}

std::string fault(const Surface& s) {
  const MadeGeometry made = mesh_of(s);
  CHECK((made.geometry == nullptr) == !made.fault.empty());
  return made.fault;
}

}  // namespace

TEST_CASE("an open surface has no mass, and its open edge is told") {
  Surface s = box_surface({1, 1, 1});
  s.triangles.pop_back();
  const MadeGeometry made = mesh_of(s);
  REQUIRE(made.geometry);
  const auto& mesh = std::get<TriangleMesh>(made.geometry->value);
  CHECK_FALSE(mesh.is_closed);
  CHECK_THAT(open_edge(mesh), Contains("the edge from (1, -1, -1) to (1, "));
  CHECK(mass_of(made).mass_kg == 0);
  CHECK(open_edge(std::get<TriangleMesh>(mesh_of(box_surface({1, 1, 1})).geometry->value)).empty());
}

TEST_CASE("a surface that is inside out is refused, and the fix told") {
  for (const Surface& s : {box_surface({1, 2, 3}), tetrahedron_surface(),
                           torus_surface(2, 0.5, 8, 6), moved(octahedron_surface(1), {9, 9, 9})}) {
    CHECK(fault(s).empty());
    CHECK_THAT(fault(turned_round(s)),
               Contains("inside out") && Contains("swap two corners of each"));
  }
}

TEST_CASE("surfaces without width, and triangles twice, are refused") {
  Surface line;
  line.vertices = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
  line.triangles = {{0, 1, 2}};
  CHECK_THAT(fault(line), Contains("no triangle that is wider"));
  Surface speck = line;
  speck.vertices = {{0, 0, 0}, {1e-7, 0, 0}, {0, 1e-7, 0}};
  CHECK_THAT(fault(speck), Contains("no triangle that is wider"));
  Surface twice;
  twice.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  twice.triangles = {{0, 1, 2}, {1, 2, 0}};
  CHECK_THAT(fault(twice), Contains("0 and 1 in one place"));
}

TEST_CASE("triangles that disagree about the outside are refused") {
  Surface s = box_surface({1, 1, 1});
  std::swap(s.triangles[5][0], s.triangles[5][1]);
  CHECK_THAT(fault(s), Contains("disagree about which side is outside") && Contains(" 5"));
}

TEST_CASE("a piece that is inside out hides behind no larger one") {
  const Surface large = box_surface({2, 2, 2}), small = box_surface({1, 1, 1});
  CHECK(fault(with(large, turned_round(small))).empty());  // a cavity
  CHECK_THAT(fault(with(large, turned_round(moved(small, {9, 0, 0})))),
             Contains("piece at (8, -1, -1) inside out"));
  CHECK_THAT(fault(with(large, small)), Contains("within another"));
  CHECK(fault(with(large, moved(small, {9, 0, 0}))).empty());
  CHECK(fault(with(large, moved(small, {3, 0, 0}))).empty());  // touches
}

TEST_CASE("vertices at one place are one: a surface in loose triangles is closed") {
  const Surface s = box_surface({1, 2, 3});
  Surface loose;
  for (const Triangle& t : s.triangles) {
    for (const auto v : t) {
      loose.vertices.push_back(s.vertices[static_cast<std::size_t>(v)]);
    }
    const auto n = static_cast<std::int32_t>(loose.vertices.size());
    loose.triangles.push_back({n - 3, n - 2, n - 1});
  }
  const MadeGeometry made = mesh_of(loose);
  REQUIRE(made.geometry);
  CHECK(std::get<TriangleMesh>(made.geometry->value).is_closed);
  CHECK(std::get<TriangleMesh>(made.geometry->value).vertices.size() == 8);
  CHECK(mass_of(made).mass_kg == Approx(48));
}

TEST_CASE("surfaces that are none are refused") {
  Surface s = box_surface({1, 1, 1});
  const auto changed = [&s](auto&& change) {
    Surface copy = s;
    change(copy);
    return fault(copy);
  };
  CHECK_THAT(fault(box_surface({1, 1, 1e-310})), Contains("encloses no volume"));
  CHECK_THAT(fault(box_surface({1, 1, 1e-14})), Contains("encloses no volume"));
  CHECK(fault(box_surface({1e-4, 1e-4, 1e-4})).empty());
  CHECK_THAT(changed([](Surface& c) { c.triangles.clear(); }), Contains("no triangles"));
  CHECK_THAT(changed([](Surface& c) { c.triangles[3][1] = 8; }), Contains("triangle 3"));
  CHECK_THAT(changed([](Surface& c) { c.triangles[3][1] = -1; }), Contains("triangle 3"));
  CHECK_THAT(changed([](Surface& c) { c.triangles[3][1] = c.triangles[3][0]; }),
             Contains("two corners at one place"));
  CHECK_THAT(changed([](Surface& c) { c.triangles.push_back(c.triangles[0]); }),
             Contains("more than two triangles"));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THAT(changed([nan](Surface& c) { c.vertices[2].y() = nan; }), Contains("not finite"));
  CHECK_THAT(changed([](Surface& c) { c.vertices[2].y() = 2 * limits::kSizeMax_m; }),
             Contains("out of range"));
  const Surface leaf{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}};
  CHECK_THAT(fault(leaf), Contains("no volume"));
}

TEST_CASE("points without a solid hull are refused") {
  const auto refusal = [](const std::vector<Vector>& points) { return make_hull(points).fault; };
  CHECK_THAT(refusal({}), Contains("four points"));
  CHECK_THAT(refusal({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), Contains("four points"));
  CHECK_THAT(refusal(std::vector<Vector>(9, Vector(1, 2, 3))), Contains("at one place"));
  std::vector<Vector> line, plane, slant;
  const Matrix R = turn(1, {1, 2, 3});
  for (int i = 0; i < 1000; ++i) {
    line.emplace_back(0.1 * i, 0.2 * i, -0.3 * i);
    for (int j = 0; j < 1000; ++j) plane.emplace_back(0.01 * i, 0.01 * j, 7);
  }
  for (std::size_t k = 0; k < plane.size(); k += 97) slant.push_back(R * plane[k]);
  CHECK_THAT(refusal(line), Contains("on one line"));
  CHECK_THAT(refusal(plane), Contains("in one plane"));  // a million of them
  CHECK_THAT(refusal(slant), Contains("in one plane"));
  slant.emplace_back(R * Vector(0, 0, 7 + 2 * limits::kSizeMin_m));
  CHECK(refusal(slant).empty());
  slant.emplace_back(std::numeric_limits<double>::infinity(), 0, 0);
  CHECK_THAT(refusal(slant), Contains("finite"));
  slant.back() = {0, 2 * limits::kSizeMax_m, 0};
  CHECK_THAT(refusal(slant), Contains("out of range"));
}

TEST_CASE("a hull keeps corners alone, however many points lie on its faces") {
  std::vector<Vector> points;
  const Matrix R = turn(0.3, {1, -2, 1});
  for (int i = 0; i <= 20; ++i) {
    for (int j = 0; j <= 20; ++j) {
      for (int k = 0; k <= 20; ++k) points.emplace_back(R * Vector(0.1 * i, 0.1 * j, 0.1 * k));
    }
  }
  const MadeGeometry made = make_hull(points);
  REQUIRE(made.geometry);
  const auto& hull = std::get<ConvexHull>(made.geometry->value);
  CHECK(hull.vertices.size() == 8);
  CHECK(hull.face_count() == 6);
  CHECK(mass_of(made).mass_kg == Approx(8).epsilon(1e-12));
}

TEST_CASE("a compound has solid parts with a density") {
  const auto refusal = [](const CompoundPart& part) { return make_compound({part}).fault; };
  CompoundPart part{Shape::sphere(1), nullptr, Vector::Zero(), Rotation::Identity(), 1000};
  CHECK(refusal(part).empty());
  CHECK_THAT(make_compound({}).fault, Contains("no parts"));
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    part.density_kgpm3 = bad;
    CHECK_THAT(refusal(part), Contains("density"));
  }
  part.density_kgpm3 = 1;
  part.shape = Shape::half_space();
  CHECK_THAT(refusal(part), Contains("no solid"));
  part.shape = {ShapeKind::mesh, {}};
  CHECK_THAT(refusal(part), Contains("no geometry"));
  Surface open = box_surface({1, 1, 1});
  open.triangles.pop_back();
  part.geometry = mesh_of(open).geometry;
  CHECK_THAT(refusal(part), Contains("its part 0 is open: the edge"));
  part.shape.kind = ShapeKind::compound;
  CHECK_THAT(refusal(part), Contains("compound itself"));
}

}  // namespace cradle
