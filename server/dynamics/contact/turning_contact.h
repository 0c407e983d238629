/// Rolling and torsional friction: torques of contacts whose materials have them. These contacts
/// have a list and a pass of their own (turning_contact.cpp); others do not pay for it.
#pragma once

#include <type_traits>
#include <variant>

#include "server/dynamics/contact/body_lines.h"
#include "server/dynamics/contact/contact_block.h"
#include "server/dynamics/contact/contact_constraint.h"

namespace cradle {

/// Of a contact, beside what its points do.
class TurningContact {
 public:
  using Block = std::variant<std::monostate, ContactBlock<double>*, ContactBlock<float>*>;

  /// Its points' impulses are in a lane of the block, or, without one, in the constraint. `c`,
  /// `block` and the bodies' lines outlive it.
  TurningContact(ContactConstraint& c, const BodyLines& bodies, Block block = {}, int lane = 0);

  /// Begins with last tick's torque, over a sub-step of `h`.
  void warm_start(BodyLines& bodies, double h);
  /// As ContactBlocks: its warm start alone, and what is left of it. Nothing if nobody was struck.
  void repeat_struck(BodyLines& bodies) const;
  void scale_struck(std::span<const double> shares, const BodyLines& bodies);
  /// Once a sub-step, when its normal impulses and friction are known.
  void rub(BodyLines& bodies);
  /// What it did, by the mean velocities of the sub-step.
  void add_work(const BodyLines& bodies, ContactBalance& balance) const;
  /// Of an impact with this normal impulse, N s.
  void rub_at_impact(BodyLines& bodies, double impulse);
  /// Keeps the torque of the last sub-step.
  void finish(double h);

 private:
  using Pair = Eigen::Vector2d;  // along t1, t2
  using Square = Eigen::Matrix2d;
  using Columns = Eigen::Matrix<double, 3, 2>;
  struct Side {
    std::int32_t line;
    double sign;  // 1: of B, -1: of A; 0: does not yield
    bool is_turned;
    double inverse_mass;
    Matrix turn;             // from the line's attitude to that for which the arms hold
    Vector about_n;          // change of the line's w by an angular impulse about n
    Columns sliding, stuck;  // likewise about t1, t2; with the friction that reacts
  };
  /// Of a point.
  struct Impulses {
    double normal, along_1, along_2;
  };
  Side side(const BodyLines& bodies, std::int32_t slot, const Rotation& turn, double sign) const;
  void find_masses(const Matrix& IA, const Matrix& IB);
  Vector w(const BodyLines& bodies, const Side& side) const;
  Vector turning(const BodyLines& bodies) const { return w(bodies, B_) - w(bodies, A_); }
  std::size_t points() const { return static_cast<std::size_t>(c_->count); }
  Impulses at(std::size_t i) const;
  void add_friction(std::size_t i, double along_1, double along_2);
  double pressing() const;
  void push(BodyLines& bodies) const;
  void twist(BodyLines& bodies, double limit);
  void roll(BodyLines& bodies, double limit);
  bool can_stick(double more_1, double more_2) const;

  ContactConstraint* c_;
  Block block_;
  int lane_;
  Side A_, B_;
  Columns t_;
  double yields_n_ = 0;                           // kg m^2; 0: nothing turns there
  double yields_sliding_ = 0, yields_stuck_ = 0;  // likewise
  Square reaction_ = Square::Zero();              // 1/m: P = reaction T of what sticks
  double T_n_ = 0;                                // N m s, of a sub-step, on B
  Pair T_t_ = Pair::Zero();
};

}  // namespace cradle
