#include "server/dynamics/mass_properties.h"

#include <cradle/limits.h>

namespace cradle {
namespace {

MassDistribution of_shape(const BodySpec& spec, const MassDistribution* stored) {
  if (stored == nullptr) return mass_distribution(spec.shape, spec.density_kgpm3);
  MassDistribution all = *stored;
  if (spec.shape.kind != ShapeKind::compound) all.mass_kg *= spec.density_kgpm3;
  return all;
}

Matrix tensor(const Vec3& diagonal, const Vec3& products) {
  Matrix J = to_eigen(diagonal).asDiagonal();
  J(0, 1) = J(1, 0) = products.x;
  J(0, 2) = J(2, 0) = products.y;
  J(1, 2) = J(2, 1) = products.z;
  return J;
}

}  // namespace

Result mass_properties(const BodySpec& spec, const MassDistribution* stored,
                       MassProperties& properties) {
  properties = {};
  if (spec.kind != BodyKind::dynamic) return Result::ok;
  if (stored != nullptr && !(stored->mass_kg > 0)) return Result::bad_shape;  // open: no solid
  const MassDistribution shape = of_shape(spec, stored);
  const double mass = spec.mass_kg > 0 ? spec.mass_kg : shape.mass_kg;
  if (!(mass > 0)) return Result::bad_mass;
  if (mass < limits::kMassMin_kg || mass > limits::kMassMax_kg) return Result::out_of_range;
  const bool is_given = spec.inertia_kgm2 != Vec3{};
  const PrincipalAxes axes = principal_axes(
      is_given ? tensor(spec.inertia_kgm2, spec.inertia_products_kgm2) : Matrix(mass * shape.G));

  const Vector& inertia = axes.moments;
  if (inertia.maxCoeff() > limits::kInertiaMax_kgm2) return Result::out_of_range;
  properties.mass_kg = mass;
  properties.inverse_mass = 1 / mass;
  properties.p_BoBcm = spec.sets_centre_of_mass ? to_eigen(spec.p_BoBcm) : shape.p_BoBcm;
  properties.q_BP = axes.q_BP;
  properties.is_offset = !properties.p_BoBcm.isZero(0) || !axes.are_of_B;
  if (inertia.isZero(0)) return Result::ok;
  if (inertia.minCoeff() < limits::kInertiaMin_kgm2) return Result::out_of_range;
  properties.inertia_kgm2 = inertia;
  properties.inverse_inertia = inertia.cwiseInverse();
  return Result::ok;
}

}  // namespace cradle
