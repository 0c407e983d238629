#include "tests/bench/masses.h"

#include <cmath>
#include <numbers>

namespace cradle::bench {
namespace {

using std::numbers::pi;

/// Integrals over a solid of 1, r and r r^T, about the origin of its frame, times the density.
struct Moments {
  double mass = 0;
  Vector first = Vector::Zero();
  Matrix second = Matrix::Zero();

  Moments& operator+=(const Moments& other) {
    mass += other.mass;
    first += other.first;
    second += other.second;
    return *this;
  }
  Moments times(double factor) const { return {factor * mass, factor * first, factor * second}; }
};

/// Of a solid whose squares have these means.
Moments symmetric(double volume, const Vector& mean_squares) {
  return {volume, Vector::Zero(), volume * Matrix(mean_squares.asDiagonal())};
}

Moments moved(const Moments& in, const Vector& t, const Matrix& R) {
  const Vector turned = R * in.first;
  return {in.mass, turned + in.mass * t,
          R * in.second * R.transpose() + turned * t.transpose() + t * turned.transpose() +
              in.mass * t * t.transpose()};
}

/// Of the tetrahedron between the origin and a triangle.
Moments of_triangle(const Vector& a, const Vector& b, const Vector& c) {
  const double det = a.dot(b.cross(c));
  const Vector sum = a + b + c;
  return {det / 6, det / 24 * sum,
          det / 120 *
              (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose())};
}

Moments of_solid(const Shape& shape) {
  const double r = shape.radius_m(), h = shape.half_length_m();
  const Vector a = to_eigen(shape.half_extents_m());
  switch (shape.kind) {
    case ShapeKind::sphere:
      return symmetric(4.0 / 3 * pi * r * r * r, Vector::Constant(r * r / 5));
    case ShapeKind::box:
      return symmetric(8 * a.prod(), a.cwiseAbs2() / 3);
    case ShapeKind::ellipsoid:
      return symmetric(4.0 / 3 * pi * a.prod(), a.cwiseAbs2() / 5);
    case ShapeKind::cylinder:
      return symmetric(2 * pi * r * r * h, {r * r / 4, r * r / 4, h * h / 3});
    case ShapeKind::capsule: {
      Moments all = of_solid(Shape::cylinder(r, h));
      all += symmetric(4.0 / 3 * pi * r * r * r,
                       {r * r / 5, r * r / 5, r * r / 5 + h * h + 0.75 * h * r});
      return all;
    }
    case ShapeKind::cone: {  // its centre is a quarter of its height above the base
      const Moments about_centre =
          symmetric(2.0 / 3 * pi * r * r * h, {3 * r * r / 20, 3 * r * r / 20, 3 * h * h / 20});
      return moved(about_centre, {0, 0, -h / 2}, Matrix::Identity());
    }
    default:
      return {};
  }
}

Moments of_geometry(const StoredGeometry& geometry);

struct OfGeometry {
  Moments operator()(const ConvexHull& hull) const {
    Moments sum;
    for (std::size_t f = 0; f < hull.face_count(); ++f) {
      const auto corner = [&](std::size_t k) -> const Vector& {
        return hull.vertices[static_cast<std::size_t>(hull.face(f)[k])];
      };
      for (std::size_t k = 2; k < hull.face(f).size(); ++k)
        sum += of_triangle(corner(0), corner(k - 1), corner(k));
    }
    return sum;
  }
  Moments operator()(const TriangleMesh& mesh) const {
    Moments sum;
    for (const Triangle& t : mesh.triangles) {
      const auto corner = [&](std::size_t k) -> const Vector& {
        return mesh.vertices[static_cast<std::size_t>(t[k])];
      };
      sum += of_triangle(corner(0), corner(1), corner(2));
    }
    return sum;
  }
  Moments operator()(const HeightField&) const { return {}; }  // no solids
  Moments operator()(const ConvexPolygon&) const { return {}; }
  Moments operator()(const Compound& compound) const {
    Moments sum;
    for (const CompoundPart& part : compound.parts) {
      const Moments solid = part.geometry ? of_geometry(*part.geometry) : of_solid(part.shape);
      sum += moved(solid.times(part.density_kgpm3), part.p_BoPo, part.q_BP.toRotationMatrix());
    }
    return sum;
  }
};

Moments of_geometry(const StoredGeometry& geometry) {
  return std::visit(OfGeometry(), geometry.value);
}

Moments of_body(const Scene& scene, const BodySpec& body) {
  if (!is_stored(body.shape.kind)) return of_solid(body.shape).times(body.density_kgpm3);
  const auto number = static_cast<std::size_t>(body.shape.parameters[0]);
  const Moments moments = of_geometry(*scene.geometries.at(number - 1));
  return body.shape.kind == ShapeKind::compound ? moments : moments.times(body.density_kgpm3);
}

}  // namespace

BodyMass mass_of(const Scene& scene, const BodySpec& body) {
  const Moments moments = of_body(scene, body);
  BodyMass result;
  if (moments.mass > 0) {
    result.p_BoBcm = moments.first / moments.mass;
    const Matrix about_centre =
        moments.second / moments.mass - result.p_BoBcm * result.p_BoBcm.transpose();
    result.J_kgm2 = about_centre.trace() * Matrix::Identity() - about_centre;  // of a kilogram
  }
  result.mass_kg = body.mass_kg > 0 ? body.mass_kg : moments.mass;
  result.J_kgm2 *= result.mass_kg;
  if (body.inertia_kgm2 != Vec3{}) {
    const Vec3 &d = body.inertia_kgm2, &p = body.inertia_products_kgm2;
    result.J_kgm2 << d.x, p.x, p.y, p.x, d.y, p.z, p.y, p.z, d.z;
  }
  if (body.sets_centre_of_mass) result.p_BoBcm = to_eigen(body.p_BoBcm);
  return result;
}

}  // namespace cradle::bench
