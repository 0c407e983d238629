// Density integrals of constant density rho (any textbook, e.g. Goldstein, Classical Mechanics,
// section 5.3):
//   sphere of radius r           V = 4/3 pi r^3    J = 2/5 m r^2
//   box of half extents a, b, c  V = 8 a b c       J_x = m/3 (b^2 + c^2), cyclic
#include "server/dynamics/mass_properties.h"

#include <cradle/limits.h>

#include <numbers>

namespace cradle {
namespace {

double volume(const Shape& shape) {
  switch (shape.kind) {
    case ShapeKind::sphere: {
      const double r = shape.radius_m();
      return 4.0 / 3.0 * std::numbers::pi * r * r * r;
    }
    case ShapeKind::box:
      return 8 * to_eigen(shape.half_extents_m()).prod();
    case ShapeKind::none:
    case ShapeKind::half_space:
      break;
  }
  return 0;
}

/// Principal moments of a kilogram of the shape.
Vector unit_inertia(const Shape& shape) {
  switch (shape.kind) {
    case ShapeKind::sphere:
      return Vector::Constant(0.4 * shape.radius_m() * shape.radius_m());
    case ShapeKind::box: {
      const Vector squares = to_eigen(shape.half_extents_m()).cwiseAbs2();
      return (Vector::Constant(squares.sum()) - squares) / 3;
    }
    case ShapeKind::none:
    case ShapeKind::half_space:
      break;
  }
  return Vector::Zero();
}

}  // namespace

Result mass_properties(const BodySpec& spec, MassProperties& properties) {
  properties = {};
  if (spec.kind != BodyKind::dynamic) return Result::ok;
  const double mass = spec.mass_kg > 0 ? spec.mass_kg : spec.density_kgpm3 * volume(spec.shape);
  if (!(mass > 0)) return Result::bad_mass;
  if (mass < limits::kMassMin_kg || mass > limits::kMassMax_kg) return Result::out_of_range;

  const Vector given = to_eigen(spec.inertia_kgm2);
  const Vector inertia = given.isZero(0) ? Vector(mass * unit_inertia(spec.shape)) : given;
  if (inertia.maxCoeff() > limits::kInertiaMax_kgm2) return Result::out_of_range;
  properties.mass_kg = mass;
  properties.inverse_mass = 1 / mass;
  if (inertia.isZero(0)) return Result::ok;
  if (inertia.minCoeff() < limits::kInertiaMin_kgm2) return Result::out_of_range;
  properties.inertia_kgm2 = inertia;
  properties.inverse_inertia = inertia.cwiseInverse();
  return Result::ok;
}

}  // namespace cradle
