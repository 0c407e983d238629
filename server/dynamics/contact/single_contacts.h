/// Contacts one after another, point by point: those whose arms hold at another time than the
/// tick's start, and friction of impacts.
#pragma once

#include "server/dynamics/contact/body_lines.h"
#include "server/dynamics/contact/contact_block.h"
#include "server/dynamics/contact/contact_constraint.h"

namespace cradle {

/// A contact and its bodies. Passes as in contact_method.h; needs the contact's effective masses.
class SingleContact {
 public:
  SingleContact(ContactConstraint& c, BodyLines& bodies);

  void warm_start();
  /// As TurningContact.
  void repeat_struck();
  void scale_struck(std::span<const double> shares);
  void solve(const SubStep& step);
  void relax(const SubStep& step);
  /// Friction of an impact, with its normal impulse. Returns what it gives B, N s.
  Vector rub(const ConstraintPoint& p, double impulse);
  /// How well it does, by the velocities at the tick's end.
  void judge(const SubStep& step, ContactResidual& residual) const;
  /// What it did, by the mean velocities of the sub-step.
  void add_work(ContactBalance& balance) const;

  Vector relative_velocity(const ConstraintPoint& p) const;
  double normal_velocity(const ConstraintPoint& p) const { return c_.n.dot(relative_velocity(p)); }
  double separation(const ConstraintPoint& p) const;
  /// Adds to the normal impulse, which never pulls; returns what it added.
  double add_normal(const ConstraintPoint& p, double change);

 private:
  /// Of a body: from its line's attitude to that for which the arms hold.
  struct Side {
    std::int32_t line;
    bool yields, is_turned;
    Matrix turn;
  };
  Side side(std::int32_t slot, const Rotation& turn) const;
  Vector w(const Side& side) const;
  Vector mean_velocity(const Side& side, const Vector& r) const;
  template <class F>
  void sweep(F&& change_of);
  void add_friction(const ConstraintPoint& p);
  void push(const ConstraintPoint& p, const Vector& impulse);
  void push(const Side& side, double inverse_mass, const Matrix& inverse_inertia, const Vector& r,
            const Vector& impulse);

  ContactConstraint& c_;
  Vector t2_;
  BodyLines& bodies_;
  Side A_, B_;
  double haste_;  // as ContactBlock::gap_haste
};

}  // namespace cradle
