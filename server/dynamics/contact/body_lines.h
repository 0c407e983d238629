/// The bodies in contact, one line of numbers each, while they go through a tick by sub-steps.
///
/// Arms of contacts hold for the attitudes at the tick's start. So does the angular velocity of a
/// body with unequal moments here: it turns with the body, w_line = R_start R^T w, and an impulse
/// changes the body's energy as it would have at the tick's start. Otherwise a rod would be spun
/// about its axis, where it has next to no inertia, by an impulse with an arm that it no longer
/// has.
///
/// A body that is round about an axis, in shape and inertia, touches with points that do not turn
/// with its spin. Its line goes along with the axis alone: with L / J_across, round the angular
/// momentum, which is constant there until something pushes. So w is, too, and nothing is to be
/// integrated.
#pragma once

#include <span>
#include <vector>

#include "server/dynamics/contact/contact_balance.h"
#include "server/dynamics/contact/contact_block.h"
#include "server/dynamics/contact/contact_solver.h"

namespace cradle {

inline Eigen::Map<Vector> linear(BodyLine& line) { return Eigen::Map<Vector>(line.all); }
inline Eigen::Map<Vector> angular(BodyLine& line) {
  return Eigen::Map<Vector>(line.all + kAngular);
}
inline Eigen::Map<const Vector> linear(const BodyLine& line) {
  return Eigen::Map<const Vector>(line.all);
}
inline Eigen::Map<const Vector> angular(const BodyLine& line) {
  return Eigen::Map<const Vector>(line.all + kAngular);
}

class BodyLines {
  template <class Lines>
  static auto& at(Lines& lines, std::int32_t line) {
    return lines[static_cast<std::size_t>(line)];
  }

 public:
  void begin(const ContactTick& tick, const BodyArrays& bodies,
             std::span<const Matrix> inverse_inertia_W);

  /// Loads and the free turning of w, over `h`; and what contacts gave in the sub-step before,
  /// again (a warm start of all of them at once, for arms, normals and inertia stay as they are).
  void integrate_velocities(double h);
  /// With the mean velocity of the sub-step where it is smooth: without an impact.
  void integrate_positions(double h, double smooth_factor);
  /// Gives the bodies their poses and velocities at the tick's end.
  void finish();

  /// Of a slot; bodies that never move share one.
  std::int32_t line(std::int32_t slot) const {
    return line_of_slot_[static_cast<std::size_t>(slot)];
  }
  bool yields(std::int32_t line) const { return line < moving_; }
  /// Stands for no body.
  std::int32_t nobody() const { return moving_ + driven_; }
  /// Where nothing is read: written for bodies that do not yield.
  std::int32_t waste() const { return moving_ + driven_ + 1; }
  std::size_t lines() const { return velocities_.size(); }
  std::size_t moving() const { return static_cast<std::size_t>(moving_); }
  bool tumbles(std::int32_t line) const {
    return yields(line) && states_[static_cast<std::size_t>(line)].tumbles;
  }

  /// Kinematic: moves, and does not yield.
  bool is_driven(std::int32_t line) const { return line >= moving_ && line < moving_ + driven_; }
  /// Of a contact with a kinematic body, the arm from that one's centre to where the contact is by
  /// now, as far as the kinematic body spins about the normal n: a contact goes along with the body
  /// that lies there, and meets other velocities. `arm` is that of the tick's start, with which a
  /// turntable would throw off what friction holds ("once round").
  Vector arm_now(std::int32_t line, std::int32_t other, const Vector& arm, const Vector& n) const;

  /// By its loads, m/s^2.
  Vector acceleration(std::int32_t line) const {
    return yields(line) ? Vector(linear(at(loads_, line))) : Vector(Vector::Zero());
  }
  /// Takes note that an impact, `t` after the start of the sub-step that comes, has changed the
  /// velocities already. Its line begins where it will lead to the right place.
  void strike(std::int32_t line, const Vector& dv, const Vector& dw, double t);

  Eigen::Map<Vector> v(std::int32_t line) { return linear(at(velocities_, line)); }
  Eigen::Map<Vector> w(std::int32_t line) { return angular(at(velocities_, line)); }
  Eigen::Map<const Vector> v(std::int32_t line) const { return linear(at(velocities_, line)); }
  Eigen::Map<const Vector> w(std::int32_t line) const { return angular(at(velocities_, line)); }
  /// Displacement and turn since the tick's start.
  Eigen::Map<const Vector> dp(std::int32_t line) const { return linear(at(motions_, line)); }
  Eigen::Map<const Vector> theta(std::int32_t line) const { return angular(at(motions_, line)); }

  // For the balance of a tick: body_balance.cpp. Nothing of it moves a body.

  /// Makes `means` those of the sub-step that is done: its velocities before and after, halved.
  void take_means(double h);
  const BodyLine* means() const { return means_.data(); }
  /// J, at these velocities of its line.
  double kinetic_energy(std::int32_t line, const Vector& v, const Vector& w) const;
  double mass(std::int32_t line) const { return 1 / bodies_.inverse_mass[at(states_, line).slot]; }
  /// Takes away what there is, before a tick; adds it, and what loads did, after the last sub-step.
  void begin_balance(ContactBalance& balance);
  void end_balance(ContactBalance& balance, double dt) const;

  BodyLine* velocities() { return velocities_.data(); }
  const BodyLine* motions() const { return motions_.data(); }

 private:
  /// Of a body that moves by its contacts: what every sub-step looks at.
  struct State {
    std::size_t slot;
    bool turns;        // has an inertia at all
    bool tumbles;      // with unequal moments
    bool is_twisted;   // by a torque
    double pull;       // m/s^2, the size of its acceleration
    double gyration2;  // m^2, largest moment by mass
  };
  /// Of those that tumble, by line, too.
  struct Turning {
    double axial_share;  // of round bodies, else 0: as in BodyArrays
    Vector axis;         // of round bodies, at the tick's start, in W
    double spin;         // rad, about it, that its line has not gone along with
    Rotation frame;      // of its line since the tick's start
    Matrix R_start;
  };

  void begin(std::int32_t line, const Matrix& inverse_inertia_W);
  Vector free_turn(const State& state, const Turning& turning, const Vector& w, double h) const;
  void turn(const State& state, Turning& turning, const Vector& w, double h);

  BodyArrays bodies_;
  std::int32_t moving_ = 0, driven_ = 0;
  std::vector<std::int32_t> line_of_slot_;
  std::vector<State> states_;
  std::vector<Turning> turnings_;
  std::vector<BodyLine> velocities_, motions_;
  std::vector<BodyLine> loads_;   // what they give to bodies that do not tumble; to others v alone
  std::vector<BodyLine> begins_;  // velocities before loads
  std::vector<BodyLine> frees_;   // after loads, before contacts
  std::vector<BodyLine> means_;
  double work_of_torques_ = 0;  // J, so far, if there is a balance
};

}  // namespace cradle
