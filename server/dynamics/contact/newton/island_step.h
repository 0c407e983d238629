/// A tick in which islands are solved one by one, each at once or else by the soft step.
#pragma once

#include "server/dynamics/contact/contact_solver.h"
#include "server/dynamics/contact/newton/island_solver.h"
#include "server/dynamics/contact/soft_step.h"
#include "server/dynamics/contact/tick_islands.h"

namespace cradle {

/// Those that are solved go on with what IslandSolver found; those that rest stay as they are; the
/// others are moved by the soft step in the same tick, from where they were.
class IslandStep : public ContactSolver {
 public:
  explicit IslandStep(const IslandSettings& settings);

  ContactReport advance(const ContactTick& tick, const BodyArrays& arrays,
                        std::span<const Matrix> inverse_inertia_W,
                        std::span<ContactConstraint* const> constraints) final;

 protected:
  enum class Fate : std::uint8_t { soft, solved, rests };
  /// All islands are soft at first, `fates()` says what is known already: `solved` is to be tried.
  virtual void choose(std::span<const Matrix> inverse_inertia_W,
                      std::span<ContactConstraint* const> constraints) = 0;
  virtual bool solve(std::size_t island) = 0;
  /// Once its constraints have the impulses.
  virtual void keep(std::size_t) {}
  virtual void end() {}

  double give() const { return give_; }
  const ContactTick& tick() const { return tick_; }
  const BodyArrays& arrays() const { return arrays_; }
  const BodyLines& bodies() const { return bodies_; }
  const TickIslands& islands() const { return islands_; }
  /// Of those to be tried, what is in them.
  std::span<Island> islands_in() { return islands_in_; }
  std::size_t island_of_body(std::size_t k) const {
    return islands_.of(static_cast<std::int32_t>(k));
  }
  std::span<Fate> fates() { return fates_; }
  IslandSolver& solver() { return solver_; }
  ContactReport& report() { return report_; }

 private:
  void list_solved();
  void list_found();
  void begin(const ContactTick& tick, std::span<const Matrix> inverse_inertia_W);
  void try_islands();
  void finish(const ContactTick& tick, std::span<ContactConstraint* const> constraints);
  void finish_apart(std::span<const Matrix> inverse_inertia_W);
  void add(const ContactReport& soft);
  /// Those that made one step, or none.
  void add_choice();
  double sag_m(const ContactConstraint& c) const;
  bool has(Fate fate) const;
  static bool is_at_once(Fate fate) { return fate != Fate::soft; }

  ContactTick tick_;
  BodyArrays arrays_;
  ContactReport report_;
  ContactBalance balance_;
  BodyLines bodies_;
  TickIslands islands_;
  std::vector<Island> islands_in_;
  IslandSettings settings_;
  double give_ = 0;  // s^2: what a load of 1 m/s^2 sinks in by
  IslandSolver solver_;
  std::unique_ptr<SoftSolver> soft_;
  std::vector<Fate> fates_;             // by island
  std::vector<std::uint8_t> are_soft_;  // likewise
  std::vector<BodyLine> ways_, ends_;   // by number: velocities that move places; at the end
  std::span<ContactConstraint* const> all_;
  std::vector<std::int32_t> moving_;  // of those that are solved
  std::vector<ContactConstraint*> chosen_;
};

}  // namespace cradle
