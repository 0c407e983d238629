/// How well contacts did in a tick, by what the solver holds at its end: how far their impulses are
/// from the laws of contact, and what became of energy and momentum.
///
/// Impulses, of the last sub-step, times a point's inverse effective mass K are velocities: so all
/// residuals but one are m/s, those of the same contact whatever the bodies weigh.
///   u = (un, u1, u2) the velocity of B against A, with un = vn + max(s, 0) / h where there is a
///   gap p = K (lambda, lambda_1, lambda_2),  u^ = u + (mu |ut|, 0, 0) natural map: |p - P(p -
///   u^)|, P the projection onto the cone |pt| <= mu pn Signorini: |min(pn, un)|;  cone: max(|pt| -
///   mu pn, 0);  complementarity: |p . u^| / K, in J
/// Source: Acary and Brogliato (2008), chapter 13; as fc3d_compute_error of Siconos, with K so that
/// impulse and velocity are of one kind.
///
/// Work is that of a sub-step's impulses on the mean of the velocities before and after it: the sum
/// over all impulses is what changes kinetic energy, exactly, so what is left over is what
/// sub-steps do wrong: pushing overlaps out, positions that go with the last velocity after an
/// impact, gyroscopic terms. Normal impulses take energy all together, of a batch of islands in a
/// sub-step; where they give, that is left over, too.
#pragma once

#include "server/collision/geometry.h"
#include "server/dynamics/contact/contact_block.h"

namespace cradle {

/// Of one point. All are 0 where the laws hold.
struct PointResidual {
  double natural_mps = 0;
  double signorini_mps = 0;      ///< it presses while it opens, or sinks in while nothing presses
  double cone_mps = 0;           ///< friction beyond its limit
  double complementarity_J = 0;  ///< friction that does not oppose the sliding at its limit
};

/// `impulse` (N s) and `velocity` (m/s, as u above) are along n, t1, t2; `K` is above 0.
PointResidual residual_of(double K, double friction, const Vector& impulse, const Vector& velocity);

/// Of many points: the largest of each.
struct ContactResidual {
  PointResidual most;
  double natural2 = 0, impulse2 = 0, velocity2 = 0;  ///< (m/s)^2, sums of squares

  void add(double K, double friction, const Vector& impulse, const Vector& velocity);
  template <class Real>
  void add(const ContactTally<Real>& tally);
  void add(const ContactResidual& other);
  /// All points' natural map, by the larger of their impulses and velocities; 0 to about 1.
  double relative() const;
};

/// Energy and momentum of bodies in contact over a tick, in W.
struct ContactBalance {
  double kinetic_J = 0;                 ///< change of kinetic energy
  double loads_J = 0;                   ///< work of gravity, forces and torques
  double friction_J = 0;                ///< work of friction: below 0
  double impacts_J = 0;                 ///< of normal impulses that slow down what comes
  double driven_J = 0;                  ///< done by kinematic bodies
  Vector mass_way = Vector::Zero();     ///< kg m: displacements times masses
  Vector momentum = Vector::Zero();     ///< N s: its change
  Vector loads_Ns = Vector::Zero();     ///< by gravity and forces
  Vector contacts_Ns = Vector::Zero();  ///< by contacts with bodies that do not yield

  void add(const ContactBalance& other);
  template <class Real>
  void add(const ContactWork<Real>& work);
};

}  // namespace cradle
