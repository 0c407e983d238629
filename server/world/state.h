/// Everything a world is made of. `for_each_part` names what influences the next tick; the hash,
/// and the test that looks into it, go by that one list.
#pragma once

#include <algorithm>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "server/collision/bounds.h"
#include "server/collision/broad_phase.h"
#include "server/collision/collider.h"
#include "server/collision/in_order.h"
#include "server/collision/manifolds.h"
#include "server/collision/narrow_phase.h"
#include "server/collision/planar_pairs.h"
#include "server/dynamics/contact/contact_solver.h"
#include "server/dynamics/schemes/scheme.h"
#include "server/dynamics/spring_step.h"
#include "server/world/balance.h"
#include "server/world/ballistic.h"
#include "server/world/body_table.h"
#include "server/world/contact_cache.h"
#include "server/world/fast_bodies.h"
#include "server/world/impact_stops.h"
#include "server/world/load_changes.h"
#include "server/world/pair_memory.h"
#include "server/world/sleeping.h"
#include "server/world/world.h"
#include "server/world/wrenches.h"

namespace cradle {

/// A pair with any number of manifolds.
struct CompositePair {
  std::size_t pair = 0;  ///< its place among the pairs
  std::vector<Manifold> manifolds;
};

/// Two bodies, by slot, and a manifold of theirs.
struct Touch {
  BodyPair pair;
  const Manifold* manifold;
  const Meeting* ahead;  ///< if it is not that of the tick's start, else null
};

/// Contacts are made this far ahead of touching, m, and as far as gravity and velocities bring
/// bodies nearer in a tick: several times the sag of a resting contact, so that a body at rest
/// never loses its contacts ("a stack of ten cubes stands").
inline constexpr double kSpeculativeMargin_m = 2e-3;
/// Likewise, of bodies less than twice as wide: a blow may throw what it strikes so far in the
/// same tick, past the middle of what was not near ("what a bullet strikes").
inline constexpr double kMarginOfThin_m = 0.02;

/// What points there are at the start of a tick, or of a part of it; without a gap, but for speed.
struct Overlaps {
  int points = 0;
  double sum_m = 0, max_m = 0;
  double closing_mps = 0;  ///< of the contact that closes fastest, if somebody asks

  /// `deepest_m`: the largest overlap of the points.
  void add(const PointsMet& met, double deepest_m) {
    points += met.count;
    sum_m += met.overlaps_m;
    max_m = std::max(max_m, deepest_m);
  }
  void add(const Overlaps& other) {
    points += other.points;
    sum_m += other.sum_m;
    max_m = std::max(max_m, other.max_m);
    closing_mps = std::max(closing_mps, other.closing_mps);
  }
};

/// A ball that holds all of a body that others could touch in the tick; or else everything.
struct ReachOfTick {
  Vector centre = Vector::Zero();  ///< m, in W
  double radius = std::numeric_limits<double>::infinity();

  bool is_apart(const ReachOfTick& other) const {
    const double both = radius + other.radius;
    return (other.centre - centre).squaredNorm() > both * both;
  }
};

struct World::State {
  explicit State(const WorldSettings& s);

  // Influences the next tick.
  WorldSettings settings;
  double dt = 0;  ///< s, of a tick; within a step, of a part of it
  Vector gravity_W;
  Tick tick = 0;
  std::int64_t next_id = 1;
  BodyTable bodies;
  std::vector<ActiveWrench> wrenches;
  std::vector<Spring> springs;  ///< in order of arrival
  ContactCache contacts;
  PairMemory memory;
  PastLoads past_loads;
  Sleepers sleepers;           ///< their contacts; the rest is made from these
  std::vector<Pose> poses;     ///< by slot: where colliders were when pairs were last looked for
  std::vector<double> turned;  ///< m, by slot: the way that a collider's points have turned at most
  std::vector<std::uint64_t> geometry_digests;  ///< of `geometries`
  bool closes_fast = false;  ///< some contact did at the start of the last part: tick_parts.h

  // Does not: made from the above, made anew each tick, or only reported.
  std::vector<GeometryPointer> geometries;  ///< numbered from 1, never changed: their digests count
  std::vector<MassDistribution> geometry_masses;  ///< of them, at density 1
  std::set<std::string> names;                    ///< of the bodies that have one
  std::unique_ptr<BroadPhase> broad_phase;
  std::unique_ptr<ContactSolver> solver;
  ContactReport solved;
  Balance balance;
  const Scheme* scheme = nullptr;
  int parts = 1;           ///< of the tick
  bool renumbered = true;  ///< lists of slots must be made anew: bodies came, went or changed
  std::vector<Event> events;
  std::int64_t quarantined = 0;
  int spins_cut = 0;  ///< as StepReport
  Loads loads;
  std::vector<std::int32_t> colliders;     ///< slots of bodies that can touch, ascending
  std::vector<std::int64_t> collider_ids;  ///< of them
  bool has_composites = false;             ///< among them
  int surfaces = 0;                        ///< likewise: meshes and height fields
  std::vector<std::uint8_t> has_parts;     ///< by slot: may touch with more than one manifold
  std::vector<std::int32_t> half_spaces;   ///< numbers of the colliders that are
  std::vector<double> reaches;             ///< m, by slot: radii of balls about Bo that hold them
  std::vector<double> turns;               ///< m, by slot: nearer_by_turning
  std::vector<double> margins;             ///< m, by slot: contacts with it are made so far ahead
  double margin_at_rest = 0;               ///< m, of bodies that are not thin
  double margin_max = 0;                   ///< m, that there could be
  std::vector<Aabb> boxes;                 ///< of colliders, in their order; not of balls apart
  std::vector<ReachOfTick> reach_of_tick;  ///< likewise: pairs of boxes meet by corners, too
  std::vector<std::uint8_t> moves;         ///< likewise
  std::vector<Plane> planes;
  std::vector<BodyPair> pairs;
  std::vector<BodyPair> pairs_of_boxes;  ///< by number of collider; of them come `pairs`
  std::vector<std::uint8_t> are_near;    ///< of these
  InOrder in_order;
  BroadPhaseReport culling;
  std::vector<Manifold> manifolds;        ///< one a pair; of convex shapes that touch
  std::vector<CompositePair> composites;  ///< the other pairs, in their order
  std::size_t composites_used = 0;        ///< of them in this tick; the rest keeps its memory
  std::vector<std::uint8_t> is_touching;  ///< by pair: `manifolds` has one of this tick
  std::vector<Touch> touching;            ///< all manifolds with a point, in the order of pairs
  FastBodies fast;
  ImpactStops stops;
  Ballistic balls;
  std::vector<double> axial_shares;             ///< by slot, see BodyArrays
  std::vector<ContactConstraint*> constraints;  ///< of `touching`, in their order
  Overlaps overlaps;                            ///< of them
  std::vector<std::uint8_t> are_unusable;       ///< of `moving`, after contacts
  std::vector<Overlaps> overlaps_of_parts;      ///< likewise: of so many at a time
  std::vector<Matrix> inverse_inertia_W;        ///< by slot, of bodies in contact
  std::vector<std::int32_t> moving, driven;     ///< slots of bodies in contact
  std::vector<std::int32_t> stirred;            ///< slots of those whose loads have just changed
  std::vector<std::int32_t> shaken;             ///< of these, by much
  std::vector<BodyLoad> pushed;                 ///< room for `past_loads`
  std::vector<Vector> x_start;                  ///< of `moving`, in their order
  std::vector<Rotation> q_start;
  std::vector<std::int32_t> dragged;    ///< slots of bodies with drag, ascending
  std::vector<std::uint8_t> is_sprung;  ///< by slot, in this tick, by a spring that acts; or empty
  int springs_unconverged = 0;
  bool keeps_accounts = false;
  std::vector<FlightAccount> accounts;  ///< by slot, of the last step, if kept
  std::vector<std::uint8_t> unsolved;   ///< by slot, see StepReport::unsolved; or empty
  std::vector<std::uint8_t> lost;       ///< by slot: the step made no usable numbers

  const PairMethods& methods() const { return pair_methods(settings.is_planar); }
  /// Planar worlds take in only what they know.
  bool can_collide(ShapeKind kind) const { return settings.is_planar || cradle::can_collide(kind); }
  BodyArrays arrays();
  FlightArrays flight_arrays();

  bool is_composite(const BodyPair& pair) const {
    if (!has_composites) return false;
    return (has_parts[static_cast<std::size_t>(pair.a)] |
            has_parts[static_cast<std::size_t>(pair.b)]) != 0;
  }

  /// m, of the ball about Bo that holds the body's shape.
  double reach(std::size_t i) const {
    const Shape& shape = bodies.shape[i];
    return is_stored(shape.kind) ? bounding_radius(*geometry(shape)) : bounding_radius(shape);
  }
  /// m, that contacts of the two may sink in by, if either says; else 0. The smaller one counts;
  /// what is not dynamic and says nothing has none.
  double contact_tolerance(std::size_t a, std::size_t b) const {
    const double of_a = bodies.contact_tolerance[a], of_b = bodies.contact_tolerance[b];
    if (of_a == 0 && of_b == 0) return 0;
    const auto tolerance = [&](std::size_t i, double own) {
      if (own > 0) return own;
      return bodies.kind[i] == BodyKind::dynamic ? settings.contact_tolerance_m
                                                 : limits::kContactToleranceMax_m;
    };
    return std::min(tolerance(a, of_a), tolerance(b, of_b));
  }
  /// Of a pair of convex shapes; it may have been made where it stays.
  void set_manifold(std::size_t pair, const Manifold& manifold) {
    is_touching[pair] = manifold.count > 0 ? 1 : 0;
    if (manifold.count > 0 && &manifold != &manifolds[pair]) manifolds[pair].copy_used(manifold);
  }
  /// m: contacts of the pair are made this far ahead.
  double margin(const BodyPair& pair) const {
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    return std::max(margins[a], margins[b]) + dt * (bodies.v[b] - bodies.v[a]).norm();
  }
  const StoredGeometry* geometry(const Shape& stored) const {
    return geometries[static_cast<std::size_t>(stored.parameters[0]) - 1].get();
  }

  /// Of a hull, mesh or compound; null for other shapes.
  const StoredGeometry* geometry(std::size_t i) const {
    const Shape& shape = bodies.shape[i];
    if (!is_stored(shape.kind)) return nullptr;
    return geometries[static_cast<std::size_t>(shape.parameters[0]) - 1].get();
  }

  /// What the narrow phase sees of a body, at its pose of this tick.
  Collider collider(std::size_t i) const { return {bodies.shape[i], poses[i], geometry(i)}; }

  /// Calls `f(name, bytes)` for every part that influences the next tick.
  template <class F>
  void for_each_part(F&& f) {
    const auto scalar = [&](const char* name, auto& value) {
      f(name, std::as_writable_bytes(std::span(&value, 1)));
    };
    const auto array = [&](const char* name, auto& values) {
      f(name, std::as_writable_bytes(std::span(values)));
    };
    scalar("dt", dt);
    scalar("sub_steps", settings.sub_steps);
    scalar("contact_tolerance_m", settings.contact_tolerance_m);
    scalar("is_full", settings.is_full);
    scalar("is_planar", settings.is_planar);
    scalar("is_sleeping", settings.is_sleeping);
    scalar("bodies_max", settings.bodies_max);
    scalar("wrenches_max", settings.wrenches_max);
    array("solver", settings.solver);
    array("scheme", settings.scheme);
    scalar("gravity", gravity_W);
    scalar("tick", tick);
    scalar("next_id", next_id);
    bodies.for_each_array(array);
    array("wrenches", wrenches);
    array("springs", springs);
    const std::span<CachedForce> forces = contacts.entries();
    array("contact forces", forces);
    memory.for_each_array(array);
    scalar("gravity before", past_loads.gravity_W);
    array("loads before", past_loads.pushed);
    array("contacts of sleepers", sleepers.contacts);
    array("poses", poses);
    array("turned", turned);
    array("geometries", geometry_digests);
    scalar("collides_twice", settings.collides_twice);
    scalar("closes_fast", closes_fast);
  }
};

// The hash reads these as bytes: they must have no padding.
static_assert(sizeof(Shape) == 8 + 8 * sizeof(double));
static_assert(sizeof(ActiveWrench) == 2 * 8 + 4 * 4 + 6 * sizeof(double) + 8);
static_assert(sizeof(Spring) == 2 * 8 + 9 * sizeof(double));
static_assert(sizeof(BodyLoad) == 8 + 6 * sizeof(double));
static_assert(sizeof(Sway) == 5 * sizeof(double));
static_assert(sizeof(Drag) == 3 * sizeof(double));
static_assert(sizeof(Poise) == 7 * 4);
static_assert(sizeof(CachedForce) == 4 * 8 + 11 * sizeof(double));
static_assert(sizeof(Material) == 4 * sizeof(double) + 2 * 4);

}  // namespace cradle
