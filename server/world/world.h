/// The world: owns the bodies and moves them from tick to tick. A pure function of the commands it
/// was given: no clock, no thread of its own, no file, no log.
///
/// Bodies are kept in the order of their creation, which is the order of their ids; everything is
/// done in that order. One thread at a time.
#pragma once

#include <cradle/world_view.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/command.h"
#include "server/collision/executor.h"
#include "server/collision/stored_geometry.h"
#include "server/dynamics/contact/contact_solver.h"
#include "server/world/forces.h"
#include "server/world/settings.h"

namespace cradle {

/// Parts of a step, for whoever measures them.
enum class Phase { collide, solve };

class StepObserver {
 public:
  virtual ~StepObserver() = default;
  virtual void enter(Phase phase) = 0;
};

/// What became of energy and momentum in a tick: balance.h says of which bodies. Work is that on
/// the bodies: what friction and impacts take is below 0.
struct StepBalance {
  Tick tick = 0;         ///< which one; 0: none yet
  double kinetic_J = 0;  ///< change of kinetic energy: the sum of what follows
  double gravity_J = 0;
  double wrenches_J =
      0;  ///< impulses at the tick's start included; in contact drag and springs, too
  double friction_J = 0;
  double impacts_J = 0;      ///< by normal impulses; of impacts with restitution by friction, too
  double driven_J = 0;       ///< by kinematic bodies
  double unaccounted_J = 0;  ///< the rest: overlaps that are pushed out, errors of integration
  double momentum_unaccounted_Ns = 0;  ///< beyond what loads and what does not yield gave
};

/// What one step came to.
struct StepReport {
  int parts = 1;                 ///< of the tick, each with contacts of its own: tick_parts.h
  int contacts = 0;              ///< points with separation <= 0 at the last one's start
  double penetration_max_m = 0;  ///< of those points
  double penetration_mean_m = 0;
  int bodies_in_contact = 0;   ///< that were sub-stepped
  int islands = 0;             ///< groups of them that touch each other
  std::int64_t sleeping = 0;   ///< bodies, at the tick's end; contacts of sleepers are not counted
  std::int64_t pairs = 0;      ///< of bodies, that were looked at for contacts
  std::int64_t pair_work = 0;  ///< to find them: boxes, nodes of trees and cells of grids seen
  std::int64_t body_sub_steps = 0;  ///< bodies in contact, each times its sub-steps
  int sub_steps_max = 0;            ///< of an island
  int islands_makeshift = 0;        ///< not of "soft": ContactReport::islands_makeshift
  int islands_at_rest = 0;          ///< of "hybrid", as ContactReport has them
  int islands_by_newton = 0;
  int islands_taken_over = 0;
  double sag_expected_m = 0;  ///< how far the most loaded contact sinks in, where bodies rest
  /// How far contact impulses are from the laws of contact at the tick's end, the worst point of
  /// each: contact_balance.h has the definitions.
  double residual_mps = 0;       ///< natural map
  double residual_relative = 0;  ///< of all points, by their impulses and velocities
  double residual_signorini_mps = 0;
  double residual_cone_mps = 0;
  double residual_complementarity_J = 0;
  StepBalance balance;          ///< of the last tick that had one: WorldSettings::balance_every
  double paid_J = 0;            ///< by what bounces, for overlaps that were pushed out
  int impacts = 0;              ///< of flying balls; what is struck at once is one
  int impacts_ordered = 0;      ///< sets of any bodies too large to be solved at once: in order
  int impacts_spent = 0;        ///< balls with so many that they lost the rest of the tick
  int springs_unconverged = 0;  ///< parts of the tick that impulses did
  int unsolved = 0;             ///< bodies whose implicit scheme did not solve its equations
  std::string_view pairs_by;    ///< how pairs were found, in a word: BroadPhaseReport::method
  /// Bodies in more pairs than are kept where too many are in one place: some of these pairs are
  /// left out, and touch nothing.
  std::int64_t crowded = 0;
  std::int64_t impact_searches = 0;  ///< for the times at which fast bodies hit others
  int stopped_at_impact = 0;         ///< fast bodies that lost the rest of the tick to a hit
  /// Of the searches, those that ended early at a safe time, and bodies that stayed where they were
  /// because those around them went on stopping each other.
  int impacts_unresolved = 0;
  int spins_cut = 0;  ///< bodies in contact that would have spun beyond the limit: quarantine.h
  /// Pairs of two meshes or height fields whose boxes overlap: these touch nothing.
  int surfaces_passing = 0;
};

/// Sums over dynamic bodies, in W, about the world's origin. For checks; nothing in a step uses it.
struct Totals {
  double kinetic_energy_J = 0;
  double potential_energy_J = 0;  ///< in the present gravity, zero at the origin, and of springs
  Vec3 momentum_Ns;
  Vec3 angular_momentum_Nms;
};

/// How a body was moved in a step, and from where.
struct FlightAccount {
  Course course = Course::still;
  FlightNeed need;                   ///< of bodies that flew
  Flight start;                      ///< at the beginning of the flight, impulses included
  double mass = 0;                   ///< kg
  Vector inertia = Vector::Zero();   ///< principal moments, kg m^2
  double offset_m = 0;               ///< of Bcm from Bo
  Vector torque_W = Vector::Zero();  ///< N m, as FlightArrays
  Vector torque_P = Vector::Zero();
  std::vector<Resultant> resultants;  ///< of the wrenches that acted
};

class World {
 public:
  struct State;  ///< state.h; for the files of this folder

  explicit World(const WorldSettings& settings);
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  /// Holds a hull, mesh or compound for the bodies that name it, from now on; the number is what
  /// their Shape::stored has. 0: there are limits::kGeometries already. The world's maker does this
  /// before it spawns; there is no command for it.
  std::int64_t add_geometry(const GeometryPointer& geometry);

  // --- commands: all of a list or nothing; what is refused changes nothing
  // -------------------------

  /// Ids of the bodies made are consecutive, from Outcome::body on.
  Outcome spawn(std::span<const BodySpec> specs);
  Outcome despawn(std::span<const BodyId> bodies);
  Outcome push(std::span<const Wrench> wrenches);
  Outcome clear_wrenches(std::span<const BodyId> bodies);
  Outcome set_motion(std::span<const Motion> motions);
  Outcome set_gravity(const Vec3& gravity_W);
  /// Of a dynamic body, from the coming tick on. Coefficients are finite, 0 to limits::kWrenchMax.
  Outcome set_drag(BodyId body, const Drag& drag);
  /// Springs act until one of their bodies is removed. At least one end is a dynamic body, and the
  /// ends are not the same body; numbers as for drag, points within
  /// limits::kPositionMax_m. At most WorldSettings::wrenches_max.
  Outcome add_springs(std::span<const Spring> springs);

  // --- time -------------------------------------------------------------------------------------

  /// One tick. `observer` may be null.
  StepReport step(Executor& executor, StepObserver* observer = nullptr);
  StepReport step();

  // --- what there is ----------------------------------------------------------------------------

  Tick tick() const;
  const WorldSettings& settings() const;
  Vec3 gravity_W() const;
  std::int64_t body_count() const;
  std::int64_t awake_count() const;  ///< dynamic, neither asleep nor in quarantine
  std::int64_t wrench_count() const;
  std::int64_t spring_count() const;
  std::int64_t quarantined_count() const;  ///< since the start
  /// True for `none`, too, which wants no contact.
  bool can_collide(ShapeKind kind) const;
  /// Bodies whose shape has no row in the pair table yet: they touch nothing.
  std::int64_t not_colliding_count() const;

  /// In ascending order of ids. Replaces what is in `states`.
  void snapshot(std::vector<BodyState>& states) const;

  /// The state of one body; false if there is none of that id.
  bool find(BodyId body, BodyState& state) const;

  /// The first `count` bodies with ids above `after`, as events of kind `described`.
  std::vector<Event> describe(BodyId after, int count) const;

  /// What happened since the last call: spawned, removed, quarantined, slept, woke. Event::client
  /// is 0.
  std::vector<Event> take_events();

  /// From the next step on, accounts() tells how each body was moved, in ascending order of ids. It
  /// costs time and memory, and changes nothing.
  void keep_accounts();
  std::span<const FlightAccount> accounts() const;

  /// Of the last step's islands: how many took which number of sub-steps, ascending.
  std::span<const SubStepChoice> sub_step_choices() const;

  Totals totals() const;

  /// Digest of everything that influences the next tick.
  std::array<std::uint8_t, 8> hash() const;

  /// For tests: the bytes of every named part that the hash covers, to change and look.
  struct StatePart {
    std::string name;
    std::span<std::byte> bytes;
  };
  std::vector<StatePart> state_parts();

 private:
  struct Steps;
  std::unique_ptr<State> state_;
};

/// The contact solvers that WorldSettings::solver can name, the default first.
std::vector<std::string> solver_names();
/// The integration schemes that WorldSettings::scheme can name, the default first.
std::vector<std::string> scheme_names();

}  // namespace cradle
