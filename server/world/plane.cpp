#include "server/world/plane.h"

#include <cmath>

#include "server/dynamics/planar_mass.h"
#include "server/dynamics/rotation.h"

namespace cradle {
namespace {

constexpr double kRoundingOfMass = 1e-9;
/// So that a half-space may be typed with five digits.
constexpr double kTiltMax_rad = 1e-4;

std::string_view attitude_out_of_plane(const Quat& q_WB, ShapeKind shape) {
  if (shape == ShapeKind::half_space) {
    const Vector normal = normalised(to_eigen(q_WB)) * Vector::UnitZ();
    return std::abs(normal.z()) <= kTiltMax_rad
               ? ""
               : "a half-space in a planar world has its normal, z in B, in the plane x, y";
  }
  return q_WB.x == 0 && q_WB.y == 0 ? "" : "its attitude in a planar world must be about z";
}

std::string_view velocity_out_of_plane(const Vec3& v_WBcm, const Vec3& w_WB) {
  if (v_WBcm.z != 0) return "its velocity in a planar world must have no z";
  if (w_WB.x != 0 || w_WB.y != 0) {
    return "its angular velocity in a planar world must have no x and y";
  }
  return "";
}

/// A half-space's attitude with the normal turned into the plane, the shortest way.
Rotation upright(const Rotation& q_WB) {
  const Vector normal = q_WB * Vector::UnitZ();
  const Vector flat = Vector(normal.x(), normal.y(), 0).normalized();
  const Vector axis = normal.cross(flat);  // with 1 + cosine: half the turn
  return normalised(Rotation(1 + normal.dot(flat), axis.x(), axis.y(), axis.z()) * q_WB);
}

std::string_view mass_out_of_plane(const MassProperties& mass) {
  const Matrix J = rotated_diagonal(mass.q_BP.toRotationMatrix(), mass.inertia_kgm2);
  const double largest = mass.inertia_kgm2.maxCoeff();
  if (std::abs(mass.p_BoBcm.z()) > kRoundingOfMass * std::sqrt(largest * mass.inverse_mass)) {
    return "its centre of mass must lie in the plane z = 0 of a planar world";
  }
  if (std::abs(J(0, 2)) + std::abs(J(1, 2)) > kRoundingOfMass * largest) {
    return "z must be a principal axis of its inertia in a planar world";
  }
  return "";
}

}  // namespace

std::string_view out_of_plane(const BodySpec& spec, const MassProperties& mass) {
  if (spec.p_WBo.z != 0) return "its position in a planar world must have z = 0";
  for (const std::string_view fault : {attitude_out_of_plane(spec.q_WB, spec.shape.kind),
                                       velocity_out_of_plane(spec.v_WBcm, spec.w_WB)}) {
    if (!fault.empty()) return fault;
  }
  return mass_out_of_plane(mass);
}

std::string_view out_of_plane(const Motion& motion, ShapeKind shape) {
  if (motion.sets_pose) {
    if (motion.p_WBo.z != 0) return "its position in a planar world must have z = 0";
    const std::string_view fault = attitude_out_of_plane(motion.q_WB, shape);
    if (!fault.empty()) return fault;
  }
  return motion.sets_velocity ? velocity_out_of_plane(motion.v_WBcm, motion.w_WB) : "";
}

std::string_view out_of_plane(const Wrench& wrench) {
  const bool is_couple = wrench.quantity == WrenchQuantity::torque ||
                         wrench.quantity == WrenchQuantity::angular_impulse;
  if (is_couple && (wrench.value.x != 0 || wrench.value.y != 0)) {
    return "a torque in a planar world must have no x and y";
  }
  if (!is_couple && wrench.value.z != 0) return "a force in a planar world must have no z";
  const bool has_point = wrench.point_kind != WrenchPoint::centre_of_mass;
  return has_point && wrench.point.z != 0 ? "its point in a planar world must have z = 0" : "";
}

std::string_view out_of_plane(const Spring& spring) {
  const bool is_in_plane = spring.point_a.z == 0 && spring.point_b.z == 0;
  return is_in_plane ? "" : "its points in a planar world must have z = 0";
}

std::string_view out_of_plane_gravity(const Vec3& gravity_W) {
  return gravity_W.z == 0 ? "" : "must have no z in a planar world";
}

MassDistribution geometry_mass(const StoredGeometry& geometry, bool is_planar) {
  if (!is_planar) return mass_distribution(geometry, 1);
  return as_solid(planar_mass({geometry.kind(), {}}, &geometry, 1));
}

Result planar_mass_properties(const BodySpec& spec, const MassDistribution* stored,
                              MassProperties& properties) {
  if (stored != nullptr) return mass_properties(spec, stored, properties);
  const MassDistribution flat = as_solid(planar_mass(spec.shape, nullptr, 1));
  return mass_properties(spec, flat.mass_kg > 0 ? &flat : nullptr, properties);
}

MassProperties planar(const MassProperties& mass) {
  MassProperties flat = mass;
  const Matrix J = rotated_diagonal(mass.q_BP.toRotationMatrix(), mass.inertia_kgm2);
  flat.q_BP = Rotation::Identity();
  flat.p_BoBcm.z() = 0;
  flat.is_offset = !flat.p_BoBcm.isZero(0);
  flat.inertia_kgm2 = Vector::Constant(J(2, 2));
  flat.inverse_inertia = J(2, 2) > 0 ? Vector(0, 0, 1 / J(2, 2)) : Vector(Vector::Zero());
  return flat;
}

void keep_in_plane(Flight& body) {
  body.x.z() = body.v.z() = 0;
  body.w.x() = body.w.y() = 0;
  body.q.x() = body.q.y() = 0;
}

void keep_in_plane(BodyTable& bodies, std::size_t i) {
  Flight body{bodies.x[i], bodies.q[i], bodies.v[i], bodies.w[i]};
  keep_in_plane(body);
  bodies.x[i] = body.x;
  bodies.v[i] = body.v;
  bodies.w[i] = body.w;
  bodies.q[i] = bodies.shape[i].kind == ShapeKind::half_space ? upright(bodies.q[i]) : body.q;
}

}  // namespace cradle
