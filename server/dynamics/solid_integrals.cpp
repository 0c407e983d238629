// Density integrals over solids: mass, centre of mass, inertia.
//
// Closed forms of constant density rho, about the centre of mass, m the mass (any textbook, e.g.
// Goldstein, Classical Mechanics, section 5.3; those of the ends of a capsule from the half ball,
// whose centre of mass is 3/8 r from its flat face):
//   sphere of radius r              V = 4/3 pi r^3    J = 2/5 m r^2
//   box of half extents a, b, c     V = 8 a b c       J_x = m/3 (b^2 + c^2), cyclic
//   ellipsoid of semi-axes a, b, c  V = 4/3 pi a b c  J_x = m/5 (b^2 + c^2), cyclic
//   cylinder, |z| <= L              V = 2 pi r^2 L    J_z = m/2 r^2, J_x = m (r^2/4 + L^2/3)
//   cone, height 2 L                V = 2/3 pi r^2 L  J_z = 3/10 m r^2, J_x = 3/20 m (r^2 + L^2),
//                                                     centre of mass at z = -L/2
//   capsule: a cylinder, and a ball in two halves, for which J_z = 2/5 m r^2 and
//                                   J_x = m (2/5 r^2 + 3/4 r L + L^2)
//
// A polyhedron is the sum of the tetrahedra between a point o and its triangles (a, b, c), taken
// with their signs; relative to o, of one tetrahedron (Tonon, J. Math. Stat. 1, 2004; Eberly,
// "Polyhedral mass properties", 2002; Mirtich, J. Graphics Tools 1, 1996):
//   V = a.(b x c)/6,  integral of x = V/4 s,  integral of x x^T = V/20 (s s^T + a a^T + b b^T + c
//   c^T),
// with s = a + b + c; and J = tr(C) 1 - C for C the integral of x x^T about the centre of mass. The
// point o is near the centre of mass, found in a first pass, so that a solid far from its origin
// loses no digits.
#include <numbers>

#include "server/collision/index.h"
#include "server/dynamics/mass_distribution.h"

namespace cradle {
namespace {

/// Moments J_x = J_y and J_z of a kilogram.
Matrix axial(double J_x, double J_z) { return Vector(J_x, J_x, J_z).asDiagonal(); }

MassDistribution capsule(double r, double L, double density) {
  const double tube = 2 * std::numbers::pi * r * r * L;
  const double ball = 4.0 / 3.0 * std::numbers::pi * r * r * r;
  const double of_tube = tube / (tube + ball), of_ball = ball / (tube + ball);
  const double J_x =
      of_tube * (r * r / 4 + L * L / 3) + of_ball * (0.4 * r * r + 0.75 * r * L + L * L);
  const double J_z = (of_tube * 0.5 + of_ball * 0.4) * r * r;
  return {density * (tube + ball), Vector::Zero(), axial(J_x, J_z)};
}

/// (sum - x^2) of three squares: proportional to the moments of a box and an ellipsoid.
Vector sums_of_others(const Vec3& half_extents) {
  const Vector squares = to_eigen(half_extents).cwiseAbs2();
  return Vector::Constant(squares.sum()) - squares;
}

/// Sums over the tetrahedra between `o` and triangles.
struct Tetrahedra {
  Vector o;
  double volume = 0;
  Vector first = Vector::Zero();
  Matrix second = Matrix::Zero();

  void add(const Vector& p, const Vector& q, const Vector& r) {
    const Vector a = p - o, b = q - o, c = r - o, s = a + b + c;
    const double V = a.dot(b.cross(c)) / 6;
    volume += V;
    first += V / 4 * s;
    second +=
        V / 20 * (s * s.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
  }
};

Tetrahedra integrate(const TriangleMesh& mesh, const Vector& o) {
  Tetrahedra all{o};
  for (const Triangle& t : mesh.triangles) {
    all.add(mesh.vertices[index(t[0])], mesh.vertices[index(t[1])], mesh.vertices[index(t[2])]);
  }
  return all;
}

Tetrahedra integrate(const ConvexHull& hull, const Vector& o) {
  Tetrahedra all{o};
  for (std::size_t f = 0; f < hull.face_count(); ++f) {
    const auto loop = hull.face(f);
    for (std::size_t k = 1; k + 1 < loop.size(); ++k) {
      all.add(hull.vertices[index(loop[0])], hull.vertices[index(loop[k])],
              hull.vertices[index(loop[k + 1])]);
    }
  }
  return all;
}

template <class Polyhedron>
MassDistribution polyhedron(const Polyhedron& solid, double density) {
  const Vector start = solid.vertices.front();
  const Tetrahedra rough = integrate(solid, start);
  const Tetrahedra fine = integrate(solid, start + rough.first / rough.volume);
  const Vector correction = fine.first / fine.volume;
  const Matrix C = fine.second / fine.volume - correction * correction.transpose();
  return {density * fine.volume, fine.o + correction, C.trace() * Matrix::Identity() - C};
}

MassDistribution compound(const Compound& all, double density) {
  std::vector<MassDistribution> parts;
  for (const CompoundPart& part : all.parts) {
    const double rho = density * part.density_kgpm3;
    parts.push_back(posed(
        part.geometry ? mass_distribution(*part.geometry, rho) : mass_distribution(part.shape, rho),
        part.p_BoPo, part.q_BP));
  }
  return sum(parts);
}

}  // namespace

MassDistribution mass_distribution(const Shape& shape, double density_kgpm3) {
  using std::numbers::pi;
  const double r = shape.radius_m(), L = shape.half_length_m();
  switch (shape.kind) {
    case ShapeKind::sphere:
      return {density_kgpm3 * (4.0 / 3.0 * pi * r * r * r), Vector::Zero(),
              Vector::Constant(0.4 * r * r).asDiagonal()};
    case ShapeKind::box: {
      const Vector G = sums_of_others(shape.half_extents_m()) / 3;
      return {density_kgpm3 * (8 * to_eigen(shape.half_extents_m()).prod()), Vector::Zero(),
              G.asDiagonal()};
    }
    case ShapeKind::ellipsoid: {
      const Vector G = sums_of_others(shape.half_extents_m()) / 5;
      return {density_kgpm3 * (4.0 / 3.0 * pi * to_eigen(shape.half_extents_m()).prod()),
              Vector::Zero(), G.asDiagonal()};
    }
    case ShapeKind::cylinder:
      return {density_kgpm3 * (2 * pi * r * r * L), Vector::Zero(),
              axial(r * r / 4 + L * L / 3, r * r / 2)};
    case ShapeKind::cone:
      return {density_kgpm3 * (2.0 / 3.0 * pi * r * r * L), Vector(0, 0, -L / 2),
              axial(0.15 * (r * r + L * L), 0.3 * r * r)};
    case ShapeKind::capsule:
      return capsule(r, L, density_kgpm3);
    case ShapeKind::none:
    case ShapeKind::half_space:
    case ShapeKind::hull:
    case ShapeKind::mesh:
    case ShapeKind::compound:
    case ShapeKind::height_field:
    case ShapeKind::polygon:
      break;
  }
  return {};
}

MassDistribution mass_distribution(const StoredGeometry& geometry, double density_kgpm3) {
  if (const auto* hull = std::get_if<ConvexHull>(&geometry.value)) {
    return polyhedron(*hull, density_kgpm3);
  }
  if (const auto* mesh = std::get_if<TriangleMesh>(&geometry.value)) {
    return mesh->is_closed ? polyhedron(*mesh, density_kgpm3) : MassDistribution{};
  }
  const auto* parts = std::get_if<Compound>(&geometry.value);
  return parts != nullptr ? compound(*parts, density_kgpm3) : MassDistribution{};
}

}  // namespace cradle
