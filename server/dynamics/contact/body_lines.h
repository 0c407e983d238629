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

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "server/collision/executor.h"
#include "server/dynamics/contact/contact_balance.h"
#include "server/dynamics/contact/contact_block.h"
#include "server/dynamics/contact/contact_solver.h"
#include "server/dynamics/contact/domains.h"

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

/// Linear and angular.
using TwistOfLine = Eigen::Array<double, 6, 1>;
inline Eigen::Map<TwistOfLine, Eigen::Aligned16> twist(BodyLine& line) {
  return Eigen::Map<TwistOfLine, Eigen::Aligned16>(line.all);
}
inline Eigen::Map<const TwistOfLine, Eigen::Aligned16> twist(const BodyLine& line) {
  return Eigen::Map<const TwistOfLine, Eigen::Aligned16>(line.all);
}

class BodyLines {
  static constexpr int kLinesWorthAThread = 128;  // of some nanoseconds each

  template <class Lines>
  static auto& at(Lines& lines, std::int32_t line) {
    return lines[static_cast<std::size_t>(line)];
  }

 public:
  void begin(const ContactTick& tick, const BodyArrays& bodies,
             std::span<const Matrix> inverse_inertia_W);

  /// Loads and the free turning of w, over `h`; and what contacts gave in the sub-step before,
  /// again (a warm start of all of them at once, for arms, normals and inertia stay as they are).
  /// Marks bodies that this changes by more than their loads explain.
  void integrate_velocities(double h, double smooth_factor);

  // A warm start that is done must not give energy: body_repeats.cpp.

  /// Likewise, where it came after that.
  void find_struck(double h, double smooth_factor);
  bool has_struck() const { return has_struck_; }
  /// Either: it is chance, so no branch.
  bool is_struck(std::int32_t a, std::int32_t b) const {
    return at(struck_, a) + at(struck_, b) > 0;
  }
  /// Takes back that bodies are struck, in islands whose contacts give no energy.
  void forgive_struck();
  /// Puts aside v and w, and in their place what contacts of struck bodies did, which is 0 at
  /// first; and back.
  void begin_repeats();
  void end_repeats() { std::swap(velocities_, repeats_); }
  /// By island what part of that their bodies may keep; they have no more from here on. Empty: all
  /// of it, everywhere.
  std::span<const double> limit_repeats();
  /// Of a contact.
  std::size_t island_of(std::int32_t a, std::int32_t b) const {
    return island_of(yields(a) ? a : b);
  }
  /// Likewise: in an island whose points are solved by themselves.
  bool is_in_heap(std::int32_t a, std::int32_t b) const {
    return !heaps_.empty() && heaps_[island_of(a, b)] != 0;
  }
  const TaskTree& tasks() const { return tasks_; }
  /// Of a contact.
  std::int32_t task_of(std::int32_t a, std::int32_t b) const {
    if (domains_.empty()) return 0;
    const std::int32_t of_a = at(domains_, yields(a) ? a : b);
    return tasks_.of(of_a, yields(b) ? at(domains_, b) : of_a);
  }
  /// With the mean velocity of the sub-step where it is smooth: without an impact. But of what
  /// rests among others with the last: springs between bodies, and the mean, feed what sways.
  void integrate_positions(double h, double smooth_factor);
  /// Moves a body without a velocity: for baselines, which part what overlaps so.
  void displace(std::int32_t line, const BodyLine& by);
  /// What contacts gave in the sub-step before is not given again in the next one.
  void forget_contacts() { std::copy_n(velocities_.begin(), moving(), frees_.begin()); }
  /// Gives the bodies their poses and velocities at the tick's end.
  void finish();

  /// Of a slot; bodies that never move share one.
  std::int32_t line(std::int32_t slot) const {
    return line_of_slot_[static_cast<std::size_t>(slot)];
  }
  bool yields(std::int32_t line) const { return line < moving_; }
  /// Stands for no body.
  std::int32_t nobody() const { return moving_ + driven_; }
  /// Where nothing is read: written for bodies that do not yield. One for each of those who work
  /// side by side.
  std::int32_t waste(std::int32_t task) const { return moving_ + driven_ + 1 + task; }
  std::size_t lines() const { return lines_; }
  std::size_t moving() const { return static_cast<std::size_t>(moving_); }
  /// Those of both that yield turn with one number instead of a matrix; in a planar world they do
  /// not.
  bool are_round(std::int32_t a, std::int32_t b) const { return is_round(a) && is_round(b); }
  bool tumbles(std::int32_t line) const {
    return yields(line) && states_[static_cast<std::size_t>(line)].tumbles;
  }

  /// Kinematic: moves, and does not yield.
  bool has_driven() const { return driven_ > 0; }
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

  // Energy that only what is pushed out has got: body_debts.cpp.

  /// Of all contacts of these bodies.
  void begin_debts(std::span<ContactConstraint* const> constraints);
  /// After the last sub-step; what was paid, J.
  double pay_debts();

  // For the balance of a tick: body_balance.cpp. Nothing of it moves a body.

  /// Makes `means` those of the sub-step that is done: its velocities before and after, halved.
  void take_means(double h);
  const BodyLine* means() const { return means_.data(); }
  /// J, at these velocities of its line.
  double kinetic_energy(std::int32_t line, const Vector& v, const Vector& w) const;
  double mass(std::int32_t line) const { return at(masses_, line); }
  /// Takes away what there is, before a tick; adds it, and what loads did, after the last sub-step.
  void begin_balance(ContactBalance& balance);
  void end_balance(ContactBalance& balance, double dt);

  BodyLine* velocities() { return velocities_.data(); }
  const BodyLine* velocities() const { return velocities_.data(); }
  const BodyLine* motions() const { return motions_.data(); }
  /// How they turn: as BlockFilling.
  const BodyLine* responses() const { return responses_.data(); }

 private:
  /// Of a body that moves by its contacts: what every sub-step looks at.
  struct State {
    std::size_t slot;
    bool turns;       // has an inertia at all
    bool tumbles;     // with unequal moments
    bool is_twisted;  // by a torque
    bool is_round;    // by one number instead of a matrix
  };
  /// Of those that tumble, by line, too.
  struct Turning {
    double axial_share;  // of round bodies, else 0: as in BodyArrays
    Vector axis;         // of round bodies, at the tick's start, in W
    double spin;         // rad, about it, that its line has not gone along with
    Rotation frame;      // of its line since the tick's start
    Rotation q;          // of others, by now
    Matrix R_start;
  };

  /// Calls `f(begin, end)` for all lines that yield, side by side.
  template <class F>
  void for_moving(const F& f) {
    executor_->for_ranges(moving_, kLinesWorthAThread, f);
  }
  /// Likewise; true if any call said so.
  template <class F>
  bool any_of_moving(const F& f) {
    constexpr std::size_t size = kLinesWorthAThread;
    const auto count = static_cast<std::size_t>(moving_);
    says_so_.resize(chunks_of(count, size));
    for_chunks(*executor_, count, size, [&](std::size_t part, std::size_t begin, std::size_t end) {
      const bool says_so = f(static_cast<std::int32_t>(begin), static_cast<std::int32_t>(end));
      says_so_[part] = says_so ? 1 : 0;
    });
    return std::ranges::find(says_so_, 1) != says_so_.end();
  }
  /// Sums over all lines that yield: `f(line, part)`, in parts that do not depend on threads.
  template <class F>
  void add_by_parts(ContactBalance& sum, const F& f) {
    constexpr std::size_t size = kLinesWorthAThread;
    balances_.assign(chunks_of(moving(), size), {});
    for_chunks(*executor_, moving(), size,
               [&](std::size_t part, std::size_t begin, std::size_t end) {
                 for (std::size_t line = begin; line < end; ++line) {
                   f(static_cast<std::int32_t>(line), balances_[part]);
                 }
               });
    for (const ContactBalance& part : balances_) sum.add(part);
  }
  bool is_round(std::int32_t line) const { return !yields(line) || at(states_, line).is_round; }
  void make_room();
  void begin_line(std::int32_t line, bool rests, const Matrix& inverse_inertia_W);
  /// As one kernel sees these lines.
  BodyRun run(std::int32_t begin, std::int32_t end);
  /// Those of `lines` from `begin` to `end`; they ascend.
  static std::span<const std::int32_t> part_of(const std::vector<std::int32_t>& lines,
                                               std::int32_t begin, std::int32_t end);
  std::size_t island_of(std::int32_t line) const {
    return islands_.empty() ? 0 : static_cast<std::size_t>(at(islands_, line));
  }
  double energy_given(std::int32_t line, const Vector& v_before, const Vector& w_before) const;
  /// By island.
  void add_up(const std::vector<double>& gains, std::vector<double>& of_islands) const;
  Vector free_turn(const State& state, const Turning& turning, const Vector& w, double h) const;
  Vector along_loads(std::int32_t line) const;  // a unit, or 0
  static void turn(Turning& turning, const Vector& w, double h);
  void move(std::size_t slot, const Vector& step);

  BodyArrays bodies_;
  Executor* executor_ = &serial_executor;
  std::int32_t moving_ = 0, driven_ = 0;
  std::size_t lines_ = 0;  // of velocities_, motions_ and struck_, which may have room for more
  std::vector<std::int32_t> line_of_slot_;
  std::vector<State> states_;
  std::vector<Turning> turnings_;
  const ContactKernels* kernels_ = nullptr;
  std::vector<BodyLine> velocities_, motions_, responses_;
  std::vector<BodyLine> loads_;   // what they give, and free turning, in a second
  std::vector<BodyLine> begins_;  // velocities before loads
  std::vector<BodyLine> frees_;   // after loads, before contacts
  std::vector<BodyLine> means_;
  std::vector<double> pull2_, gyration2_, mean_pull2_, mean_gyration2_, masses_;  // as BodyRun
  std::vector<std::int32_t> tumbling_, twisted_;                                  // lines
  std::span<const std::int32_t> islands_;  // by line; or empty
  std::size_t islands_count_ = 1;
  std::span<const std::uint8_t> heaps_;    // by island; or empty
  std::span<const std::int32_t> domains_;  // by line; or empty
  std::span<const std::int32_t> places_;   // lines, by ascending slots; or empty: as they are
  TaskTree tasks_;
  struct Debt {
    bool bounces = true, is_held = false, is_driven = false, is_along = false;
    double sum_J = 0, kinetic_J = 0, along_J = 0, mass = 0, share = 1;
    Vector momentum = Vector::Zero(), v = Vector::Zero();
  };
  std::vector<Debt> debts_;     // by island
  std::vector<double> struck_;  // by line: 1, or 0
  bool has_struck_ = false;
  std::vector<std::uint8_t> says_so_;  // parts of lines: any_of_moving
  std::vector<BodyLine> repeats_;
  std::vector<double> gains_,
      own_gains_;  // J, of kinetic energy, by line: by repeats; by themselves
  std::vector<double> gains_of_islands_, own_gains_of_islands_;
  std::vector<double> shares_;
  std::vector<ContactBalance> balances_;  // by part
  double work_of_torques_ = 0;            // J, so far, if there is a balance
};

}  // namespace cradle
