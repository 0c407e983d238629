/// One body on points of its own, for contact solvers without a world.
#pragma once

#include <vector>

#include "server/dynamics/contact/contact_solver.h"

namespace cradle {

/// A body above fixed ground, which it touches with points; outside of any world.
struct Standing {
  std::vector<Vector> x{Vector::Zero(), Vector(0, 0, 1)}, v{2, Vector::Zero()},
      w{2, Vector::Zero()}, acceleration{2, Vector::Zero()}, torque{2, Vector::Zero()};
  std::vector<Rotation> q{2, Rotation::Identity()};
  std::vector<Vector> inertia{Vector::Zero(), Vector::Ones()}, inverse_inertia = inertia;
  std::vector<double> inverse_mass{0, 1};
  std::vector<std::int32_t> moving{1};
  std::vector<Vector> feet{{0, 0, -1}};  // in the body
  double friction = 0, dt = 0.01;
  std::vector<Matrix> inverse_inertia_W;  // of this moment
  std::vector<ContactConstraint> contact;

  void set_mass(double mass_kg, const Vector& J) {
    inverse_mass[1] = 1 / mass_kg;
    inertia[1] = J;
    inverse_inertia[1] = J.cwiseInverse();
  }
  BodyArrays arrays() {
    return {x, q, v, w, inverse_mass, inertia, inverse_inertia, acceleration, torque};
  }
  ContactTick tick() const { return {dt, 0, 5e-4, 0, moving, {}}; }
  /// The contact as the feet stand now, with the forces that it had.
  void touch() {
    const Matrix R = q[1].toRotationMatrix();
    inverse_inertia_W = {Matrix::Zero(), R * inverse_inertia[1].asDiagonal() * R.transpose()};
    Manifold manifold;
    manifold.normal_W = Vector::UnitZ();
    manifold.count = static_cast<int>(feet.size());
    for (std::size_t k = 0; k < feet.size(); ++k) {
      manifold.points[k].p_W = x[1] + q[1] * feet[k];
      manifold.points[k].separation = manifold.points[k].p_W.z();
    }
    const auto before = contact;
    contact = {make_constraint(manifold, 0, 1, arrays(), inverse_inertia_W)};
    contact[0].friction = friction;
    for (std::size_t k = 0; k < feet.size() && !before.empty(); ++k) {
      contact[0].points[k].force = before[0].points[k].force;
      contact[0].points[k].force_t = before[0].points[k].force_t;
      contact[0].points[k].press = before[0].points[k].press;
    }
  }
  ContactReport step(ContactSolver& solver) {
    touch();
    ContactConstraint* const all[] = {&contact[0]};
    return solver.advance(tick(), arrays(), inverse_inertia_W, all);
  }
  /// Of a foot, N, in W.
  Vector force(std::size_t k) const {
    const ContactConstraint& c = contact[0];
    const ConstraintPoint& p = c.points[k];
    return p.force * c.n + p.force_t.x() * c.t1 + p.force_t.y() * c.t2();
  }
};

}  // namespace cradle
