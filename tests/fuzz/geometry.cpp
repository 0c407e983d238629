// Points, triangles, OBJ text and parts, to what makes geometry of them. What is refused has a
// reason; what is taken is what it claims to be, has mass, and collides without nonsense.
#include <Eigen/Eigenvalues>
#include <cmath>
#include <set>

#include "server/collision/bounds.h"
#include "server/collision/index.h"
#include "server/collision/manifolds.h"
#include "server/collision/narrow_phase.h"
#include "server/dynamics/mass_distribution.h"
#include "server/mesh_file.h"
#include "tests/fuzz/input.h"

namespace cradle::fuzz {
namespace {

/// Points in one of four forms: any bits; whole numbers times a scale; the same and a little more;
/// on few places of a small grid, so that many are duplicates, collinear or coplanar.
std::vector<Vector> take_points(Input& in) {
  const std::size_t form = in.below(4);
  const double scale = std::pow(10, static_cast<double>(in.below(12)) - 6);
  std::vector<Vector> points(in.any<std::uint8_t>());
  for (Vector& p : points) {
    for (double& x : p) {
      if (form == 0) x = in.any<double>();
      if (form == 1 || form == 2) x = scale * in.any<std::int8_t>();
      if (form == 2) x += 1e-7 * scale * in.any<std::int8_t>();
      if (form == 3) x = scale * static_cast<double>(in.below(3));
    }
  }
  return points;
}

std::vector<Triangle> take_triangles(Input& in) {
  std::vector<Triangle> triangles(in.any<std::uint8_t>());
  for (Triangle& triangle : triangles) {
    for (std::int32_t& corner : triangle) corner = in.any<std::int8_t>();
  }
  return triangles;
}

double extent_of(std::span<const Vector> points) {
  double extent = 0;
  for (const Vector& p : points) extent = std::max(extent, (p - points[0]).norm());
  return extent;
}

void check_hull(const ConvexHull& hull, std::span<const Vector> points) {
  std::set<std::pair<std::int32_t, std::int32_t>> edges;
  for (std::size_t f = 0; f < hull.face_count(); ++f) {
    const auto loop = hull.face(f);
    require(loop.size() >= 3, "a face has three corners");
    for (std::size_t k = 0; k < loop.size(); ++k) {
      require(loop[k] >= 0 && index(loop[k]) < hull.vertices.size(), "a corner is a vertex");
      const bool is_new = edges.emplace(loop[k], loop[(k + 1) % loop.size()]).second;
      require(is_new, "each side of an edge has one face");
    }
  }
  for (const auto& [from, to] : edges)
    require(edges.contains({to, from}), "each edge has two sides");
  require(hull.vertices.size() + hull.face_count() == edges.size() / 2 + 2, "Euler's formula");

  // Qhull's own rounding, and that of the coordinates.
  double largest = 0;
  for (const Vector& p : points) largest = std::max(largest, p.cwiseAbs().maxCoeff());
  const double slack = 1e-9 * extent_of(points) + 1e-13 * largest;
  for (std::size_t f = 0; f < hull.face_count(); ++f) {
    require(std::abs(hull.normals[f].norm() - 1) < 1e-9, "a face has a unit normal");
    for (const Vector& p : points)
      require(hull.normals[f].dot(p) <= hull.offsets[f] + slack, "all points are inside");
  }
  require(hull.inner_radius > 0, "a hull has an inside");
}

void check_mesh(const TriangleMesh& mesh) {
  for (const Triangle& triangle : mesh.triangles) {
    for (const std::int32_t corner : triangle)
      require(corner >= 0 && index(corner) < mesh.vertices.size(), "a corner is a vertex");
  }
  require(mesh.is_closed == open_edge(mesh).empty(), "what is open has an open edge");
}

void check_mass(const StoredGeometry& geometry, bool is_solid) {
  const MassDistribution mass = mass_distribution(geometry, 1000);
  require(std::isfinite(mass.mass_kg) && mass.p_BoBcm.allFinite() && mass.G.allFinite(),
          "a mass is finite");
  require(is_solid == (mass.mass_kg > 0), "what is solid has mass");
  if (geometry.kind() != ShapeKind::hull) return;  // meshes may cut themselves
  const Eigen::SelfAdjointEigenSolver<Matrix> axes(mass.G);
  require(axes.eigenvalues().minCoeff() > 0, "a hull resists turning");
}

void check_contacts(const StoredGeometry& geometry, Input& in) {
  const Shape shape = Shape::stored(geometry.kind(), 1);
  const Aabb box = bounds(Collider{shape, {}, &geometry});
  const double size =
      box.is_empty() ? 1.0 : std::clamp((box.upper - box.lower).maxCoeff(), 1e-4, 1e6);
  const Vector turn(in.any<std::int8_t>(), in.any<std::int8_t>(), in.any<std::int8_t>());
  const Pose X_WA{box.is_empty() ? Vector::Zero() : Vector(-0.5 * (box.lower + box.upper)),
                  Matrix::Identity()};
  Pose X_WB;
  for (double& x : X_WB.x) x = size / 128 * in.any<std::int8_t>();
  X_WB.R = Eigen::AngleAxisd(turn.norm() / 64, (turn + Vector(0, 0, 1e-9)).normalized());
  const double r = 0.3 * size;
  const Shape others[] = {Shape::sphere(r),     Shape::box({r, r, r}),
                          Shape::capsule(r, r), Shape::cylinder(r, r),
                          Shape::cone(r, r),    Shape::ellipsoid({r, r, r / 2}),
                          Shape::half_space(),  shape};
  std::vector<Manifold> manifolds;
  for (const Shape& other : others) {
    const Collider A{shape, X_WA, &geometry}, B{other, X_WB, &geometry};
    const double margin = 0.01 * size;
    manifolds.clear();
    if (is_composite(A.shape.kind) || is_composite(B.shape.kind)) {
      add_manifolds(A, B, margin, manifolds);
    } else {
      manifolds.push_back(collide(A, B, margin));
    }
    for (const Manifold& manifold : manifolds) {
      require(manifold.count >= 0 && manifold.count <= kManifoldPoints, "at most four points");
      if (manifold.count == 0) continue;
      require(std::abs(manifold.normal_W.norm() - 1) < 1e-9, "a normal is unit");
      for (int k = 0; k < manifold.count; ++k) {
        const ContactPoint& point = manifold.points[static_cast<std::size_t>(k)];
        require(point.p_W.allFinite() && std::isfinite(point.separation), "points are finite");
        require(point.separation <= margin, "points are within the margin");
      }
    }
  }
}

/// What came of it, if it was taken.
GeometryPointer taken(const MadeGeometry& made) {
  require((made.geometry == nullptr) != made.fault.empty(), "a refusal has a reason");
  return made.geometry;
}

GeometryPointer hull_of(std::span<const Vector> points) {
  GeometryPointer geometry = taken(make_hull(points));
  if (!geometry) return nullptr;
  check_hull(std::get<ConvexHull>(geometry->value), points);
  check_mass(*geometry, true);
  return geometry;
}

GeometryPointer mesh_of(std::span<const Vector> points, std::span<const Triangle> triangles) {
  GeometryPointer geometry = taken(make_mesh(points, triangles));
  if (!geometry) return nullptr;
  const auto& mesh = std::get<TriangleMesh>(geometry->value);
  check_mesh(mesh);
  check_mass(*geometry, mesh.is_closed);
  return geometry;
}

GeometryPointer compound_of(Input& in) {
  std::vector<CompoundPart> parts(in.below(8));
  for (CompoundPart& part : parts) {
    const auto size = [&] {
      return std::pow(10,
                      static_cast<double>(in.any<std::uint8_t>()) / 25.6 - 4);  // 0.1 mm .. 1000 km
    };
    // As the scene's reader gives them: sizes validated, of stored geometry any kind.
    if (in.one_in(4)) {
      part.shape = Shape::stored(static_cast<ShapeKind>(8 + in.below(3)), 1);
      part.geometry = taken(make_hull(take_points(in)));
    } else {
      part.shape.kind = static_cast<ShapeKind>(in.below(8));
      for (std::size_t k = 0; k < size_count(part.shape.kind); ++k)
        part.shape.parameters[k] = size();
    }
    for (double& x : part.p_BoPo) x = in.any<std::int8_t>();
    part.density_kgpm3 = in.one_in(8) ? in.any<double>() : 1000;
  }
  GeometryPointer geometry = taken(make_compound(std::move(parts)));
  return geometry;
}

void run(Input in) {
  GeometryPointer geometry;
  switch (in.below(4)) {
    case 0:
      geometry = hull_of(take_points(in));
      break;
    case 1: {
      const std::vector<Vector> points = take_points(in);
      geometry = mesh_of(points, take_triangles(in));
      break;
    }
    case 2: {
      const ByteView bytes = in.take(2048);
      const std::string text(bytes.begin(), bytes.end());
      try {
        const MeshFile file = parse_obj(text, "file");
        hull_of(file.vertices);
        geometry = mesh_of(file.vertices, file.triangles);
      } catch (const MeshFileError& error) {
        require(std::string_view(error.what()).starts_with("file:"), "an error names its place");
      }
      break;
    }
    default:
      geometry = compound_of(in);
  }
  if (geometry) check_contacts(*geometry, in);
}

}  // namespace
}  // namespace cradle::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  cradle::fuzz::run(cradle::fuzz::Input({data, size}));
  return 0;
}
