// Area integrals of constant density sigma, m the mass (any textbook):
//   circle of radius r     A = pi r^2     J = m/2 r^2
//   capsule, segment 2 L   a rectangle of 2 L by 2 r with J = m/3 (L^2 + r^2), and a circle
//                          in two halves, whose centres are at L + 4 r / (3 pi):
//                          J = m (r^2/2 + 8 r L / (3 pi) + L^2)
//   polygon                Green's theorem (e.g. Soerjadi, TU Delft, 1968): sums over its edges
//                          (p, q), relative to a point near the centre:
//     A = sum (p x q)/2,  integral of x = sum (p x q)(p + q)/6,
//     integral of |x|^2 = sum (p x q)(p.p + p.q + q.q)/12
#include "server/dynamics/planar_mass.h"

#include <cmath>
#include <numbers>
#include <vector>

namespace cradle {
namespace {

constexpr std::size_t kCornersMax = 4096;  // each pair of edges is looked at

double planar_cross(const PlanarVector& a, const PlanarVector& b) {
  return a.x() * b.y() - a.y() * b.x();
}

struct Sums {
  double area = 0;
  PlanarVector first = PlanarVector::Zero();
  double second = 0;
  double area_of_all = 0;  ///< without signs: what rounding is measured by
};

Sums integrate_polygon(std::span<const PlanarVector> corners, const PlanarVector& o) {
  Sums sums;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const PlanarVector p = corners[k] - o, q = corners[(k + 1) % corners.size()] - o;
    const double c = planar_cross(p, q);
    sums.area += c / 2;
    sums.area_of_all += std::abs(c) / 2;
    sums.first += c / 6 * (p + q);
    sums.second += c / 12 * (p.dot(p) + p.dot(q) + q.dot(q));
  }
  return sums;
}

/// On which side of the line from a to b is p: left 1, right -1, on it 0.
int side(const PlanarVector& a, const PlanarVector& b, const PlanarVector& p) {
  const double value = planar_cross(b - a, p - a);
  return (value > 0) - (value < 0);
}

/// Whether p, on the line through a and b, lies between them.
bool is_between(const PlanarVector& a, const PlanarVector& b, const PlanarVector& p) {
  return (p - a).dot(p - b) <= 0;
}

bool do_meet(const PlanarVector& a, const PlanarVector& b, const PlanarVector& c,
             const PlanarVector& d) {
  const int abc = side(a, b, c), abd = side(a, b, d), cda = side(c, d, a), cdb = side(c, d, b);
  if (abc != abd && cda != cdb && abc * abd <= 0 && cda * cdb <= 0) return true;
  return (abc == 0 && is_between(a, b, c)) || (abd == 0 && is_between(a, b, d)) ||
         (cda == 0 && is_between(c, d, a)) || (cdb == 0 && is_between(c, d, b));
}

/// Whether an edge meets one that is not its neighbour, or folds back onto its neighbour.
bool meets_itself(std::span<const PlanarVector> corners) {
  const std::size_t n = corners.size();
  for (std::size_t i = 0; i < n; ++i) {
    const PlanarVector &a = corners[i], &b = corners[(i + 1) % n], &c = corners[(i + 2) % n];
    if (a == b || (side(a, b, c) == 0 && (b - a).dot(c - b) < 0)) return true;
    for (std::size_t j = i + 2; j < n; ++j) {
      if (i == 0 && j == n - 1) continue;  // neighbours
      if (do_meet(a, b, corners[j], corners[(j + 1) % n])) return true;
    }
  }
  return false;
}

}  // namespace

PlanarMass planar_circle(double radius_m, double density_kgpm2) {
  const double mass = density_kgpm2 * std::numbers::pi * radius_m * radius_m;
  return {mass, PlanarVector::Zero(), 0.5 * mass * radius_m * radius_m};
}

PlanarMass planar_capsule(double radius_m, double half_length_m, double density_kgpm2) {
  using std::numbers::pi;
  const double r = radius_m, L = half_length_m;
  const double middle = density_kgpm2 * 4 * r * L, ends = density_kgpm2 * pi * r * r;
  return {middle + ends, PlanarVector::Zero(),
          middle * (L * L + r * r) / 3 + ends * (r * r / 2 + 8 * r * L / (3 * pi) + L * L)};
}

MadePlanarMass planar_polygon(std::span<const PlanarVector> corners, double density_kgpm2) {
  const auto refused = [](const char* fault) { return MadePlanarMass{{}, fault}; };
  if (corners.size() < 3) return refused("needs three corners or more");
  if (corners.size() > kCornersMax) return refused("has too many corners");
  for (const PlanarVector& p : corners) {
    if (!p.allFinite()) return refused("has a corner that is not finite");
  }
  if (!(density_kgpm2 > 0 && std::isfinite(density_kgpm2))) {
    return refused("has no density above 0");
  }
  const Sums rough = integrate_polygon(corners, corners[0]);
  if (!(std::abs(rough.area) > 1e-13 * rough.area_of_all)) return refused("has no area");
  if (meets_itself(corners)) return refused("meets itself");
  if (rough.area < 0) return refused("is inside out: its corners run clockwise; reverse them");
  const PlanarVector o = corners[0] + rough.first / rough.area;
  const Sums fine = integrate_polygon(corners, o);
  const PlanarVector correction = fine.first / fine.area;
  return {{density_kgpm2 * fine.area, o + correction,
           density_kgpm2 * (fine.second - fine.area * correction.squaredNorm())},
          {}};
}

PlanarMass posed(const PlanarMass& part, const PlanarVector& shift, double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  const PlanarVector& p = part.p_BoBcm;
  return {part.mass_kg, shift + PlanarVector(c * p.x() - s * p.y(), s * p.x() + c * p.y()),
          part.inertia_kgm2};
}

PlanarMass sum(std::span<const PlanarMass> parts) {
  PlanarMass whole;
  for (const PlanarMass& part : parts) whole.mass_kg += part.mass_kg;
  if (!(whole.mass_kg > 0)) return {};
  for (const PlanarMass& part : parts) {
    whole.p_BoBcm += part.mass_kg / whole.mass_kg * part.p_BoBcm;
  }
  for (const PlanarMass& part : parts) {
    whole.inertia_kgm2 +=
        part.inertia_kgm2 + part.mass_kg * (part.p_BoBcm - whole.p_BoBcm).squaredNorm();
  }
  return whole;
}

PlanarMass planar_mass(const Shape& shape, const StoredGeometry* geometry, double density_kgpm3) {
  switch (shape.kind) {
    case ShapeKind::sphere:
      return planar_circle(shape.radius_m(), density_kgpm3);
    case ShapeKind::capsule:
      return planar_capsule(shape.radius_m(), shape.half_length_m(), density_kgpm3);
    case ShapeKind::box: {
      const Vec3 h = shape.half_extents_m();
      const double mass = density_kgpm3 * 8 * h.x * h.y * h.z;
      return {mass, PlanarVector::Zero(), mass * (h.x * h.x + h.y * h.y) / 3};
    }
    case ShapeKind::polygon: {
      std::vector<PlanarVector> corners;
      for (std::size_t k = 0; k < shape.corner_count(); ++k) {
        corners.emplace_back(shape.corner_m(k).x, shape.corner_m(k).y);
      }
      return planar_polygon(corners, density_kgpm3).mass;
    }
    default:
      break;
  }
  if (geometry == nullptr) return {};
  if (const auto* polygon = std::get_if<ConvexPolygon>(&geometry->value)) {
    return planar_polygon(polygon->corners, density_kgpm3).mass;
  }
  std::vector<PlanarMass> parts;
  if (const auto* compound = std::get_if<Compound>(&geometry->value)) {
    for (const CompoundPart& part : compound->parts) {
      const PlanarMass own =
          planar_mass(part.shape, part.geometry.get(), density_kgpm3 * part.density_kgpm3);
      const Matrix R = part.q_BP.toRotationMatrix();
      parts.push_back({own.mass_kg, part.p_BoPo.head<2>() + R.topLeftCorner<2, 2>() * own.p_BoBcm,
                       own.inertia_kgm2});
    }
  }
  return sum(parts);
}

MassDistribution as_solid(const PlanarMass& mass) {
  if (!(mass.mass_kg > 0)) return {};
  return {mass.mass_kg, Vector(mass.p_BoBcm.x(), mass.p_BoBcm.y(), 0),
          Vector::Constant(mass.inertia_kgm2 / mass.mass_kg).asDiagonal()};
}

PlanarMass with_mass(const PlanarMass& spread, double mass_kg) {
  return {mass_kg, spread.p_BoBcm, mass_kg / spread.mass_kg * spread.inertia_kgm2};
}

}  // namespace cradle
