#include "server/world/fast_bodies.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/collision/bounds.h"
#include "server/collision/extents.h"
#include "server/collision/index.h"
#include "server/dynamics/rotation.h"
#include "server/world/state.h"

namespace cradle {
namespace {

/// The angular velocity of the body's shape. A body that is round in shape and inertia spins about
/// its axis unseen, and its axis goes round the angular momentum, at a constant rate while nothing
/// twists it: w_shape = L / J_across = w - (1 - share) w_along. Returns w_along's part that is
/// unseen, rad/s.
double take_unseen_spin(const World::State& s, std::size_t i, const Vector& axis, Vector& w) {
  const double share = s.axial_shares[i];
  if (share == 0) return 0;
  const double unseen = (1 - share) * axis.dot(w);
  w -= unseen * axis;
  return unseen;
}

/// Where its body's way of this tick is expected to lead, with the loads it has.
Path expected(const World::State& s, std::size_t i) {
  const BodyTable& bodies = s.bodies;
  Path path;
  path.x = bodies.x[i];
  path.travel = s.dt * bodies.v[i];
  Vector w = bodies.w[i];
  path.spin = s.dt * take_unseen_spin(s, i, s.poses[i].R.col(2), w);
  path.turn = s.dt * w;
  const Course course = s.loads.course[i];
  if (course == Course::falls) path.travel += 0.5 * s.dt * s.dt * s.gravity_W;
  if (course == Course::pushed) path.travel += 0.5 * s.dt * s.dt * s.loads.acceleration[i];
  return path;
}

/// The rotation vector from R to q that is nearest to `about`: more than half a turn may be asked
/// for.
Vector turn_between(const Matrix& R, const Rotation& q, const Vector& about) {
  Vector turn = rotation_log(normalised(q * Rotation(R).conjugate()));
  const double expected = about.norm();
  if (expected < 3) return turn;
  const double angle = turn.norm();
  const Vector axis = angle > 1e-9 ? Vector(turn / angle) : Vector(about / expected);
  constexpr double kTurn = 2 * std::numbers::pi;
  return turn + axis * (kTurn * std::round((axis.dot(about) - angle) / kTurn));
}

/// How far rotation alone moves its surface, at most, m.
double turning(const FastLimits& limits, const Pose& X, const Vector& p_BoBcm, const Vector& turn) {
  if (turn.isZero(0)) return 0;
  const double surface = limits.is_round ? turn.cross(X.R.col(2)).norm() : turn.norm();
  return turn.cross(X.R * p_BoBcm).norm() + surface * limits.turn_radius;
}

double sum(const Vector& v) { return v.cwiseAbs().sum(); }

/// Sums of components are never shorter than lengths: most ways are told by those of what a body
/// travels (m) and turns by (rad).
bool is_surely_short(const FastLimits& limits, const Vector& p_BoBcm, double travel, double turn) {
  constexpr double kSurely = 0.999;
  const double most = kSurely * limits.thickness;
  return travel <= most && turn * (sum(p_BoBcm) + limits.turn_radius) <= most;
}

/// Whether the balls about both centres keep apart on their whole ways.
bool keeps_off(const World::State& s, std::size_t a, const Path& A, std::size_t b, const Path& B) {
  const double reach = s.fast.limits[a].reach + s.fast.limits[b].reach;
  if (A.until < 1 || B.until < 1 || !std::isfinite(reach)) return false;
  const Vector from = B.x - A.x, way = B.travel - A.travel;
  const double length2 = way.squaredNorm();
  const double t = length2 > 0 ? std::clamp(-from.dot(way) / length2, 0.0, 1.0) : 0.0;
  const double far = 1.001 * reach + impact_lengths(reach, reach).gap;
  return (from + t * way).squaredNorm() > far * far;
}

/// Null for pairs of convex shapes.
CompositePair* composite_of(World::State& s, std::size_t pair) {
  const auto begin = s.composites.begin();
  const auto end = begin + static_cast<std::ptrdiff_t>(s.composites_used);
  const auto found = std::lower_bound(
      begin, end, pair, [](const CompositePair& one, std::size_t k) { return one.pair < k; });
  return found != end && found->pair == pair ? &*found : nullptr;
}

bool has_overlap(const Manifold& manifold) {
  const auto points = std::span(manifold.points).first(static_cast<std::size_t>(manifold.count));
  return std::ranges::any_of(points, [](const ContactPoint& p) { return p.separation < 0; });
}

/// Whether they touch where the tick begins. A search for impacts with a surface does not tell of a
/// body whose middle is inside.
bool overlap_already(World::State& s, std::size_t pair) {
  const CompositePair* composite = composite_of(s, pair);
  return (s.is_touching[pair] != 0 && has_overlap(s.manifolds[pair])) ||
         (composite != nullptr && std::ranges::any_of(composite->manifolds, has_overlap));
}

void forget_manifolds(World::State& s, std::size_t pair) {
  s.is_touching[pair] = 0;
  if (CompositePair* composite = composite_of(s, pair)) composite->manifolds.clear();
}

/// The manifolds of the poses where they meet.
void collide_ahead(World::State& s, const Meeting& meeting) {
  const auto [slot_A, slot_B] = s.pairs[meeting.pair];
  const std::size_t a = index(slot_A), b = index(slot_B);
  const Pose X_WA = moved(meeting.A, s.poses[a], meeting.time);
  const Pose X_WB = moved(meeting.B, s.poses[b], meeting.time);
  const Collider A{s.bodies.shape[a], X_WA, s.geometry(a)};
  const Collider B{s.bodies.shape[b], X_WB, s.geometry(b)};
  const double margin = std::max(s.margins[a], s.margins[b]);
  if (CompositePair* composite = composite_of(s, meeting.pair)) {
    add_manifolds(A, B, margin, composite->manifolds, s.methods());
    return;
  }
  s.set_manifold(meeting.pair, s.methods().collide(A, B, margin));
}

}  // namespace

Path travelled(const World::State& s, std::size_t i, const Vector& w_start) {
  const BodyTable& bodies = s.bodies;
  const Pose& X = s.poses[i];
  Path path;
  path.x = X.x + X.R * bodies.p_BoBcm[i];
  path.travel = bodies.x[i] - path.x;
  if (bodies.kind[i] == BodyKind::fixed) return path;
  Rotation q = bodies.frame(i).q_WB;
  Vector before = w_start, after = bodies.w[i];
  take_unseen_spin(s, i, X.R.col(2), before);
  take_unseen_spin(s, i, q * Vector::UnitZ(), after);
  const Vector about = s.dt * Vector(0.5 * (before + after));
  if (s.axial_shares[i] != 0) {  // the spin that leaves nothing else but `about`, nearly
    const Rotation rest = q.conjugate() * rotation_exp(about) * Rotation(X.R);
    path.spin = -2 * std::atan2(rest.z(), rest.w());
    q = q * Rotation(Eigen::AngleAxisd(-path.spin, Vector::UnitZ()));
  }
  path.turn = turn_between(X.R, q, about);
  return path;
}

bool is_far(const World::State& s, std::size_t i, const Path& path) {
  const FastLimits& limits = s.fast.limits[i];
  if (is_surely_short(limits, s.bodies.p_BoBcm[i], sum(path.travel), sum(path.turn))) return false;
  const double most = limits.thickness;
  return path.travel.squaredNorm() > most * most ||
         turning(limits, s.poses[i], s.bodies.p_BoBcm[i], path.turn) > most;
}

Aabb box_of_path(const World::State& s, std::size_t i, const Path& path) {
  Aabb box = s.methods().bounds(s.collider(i));
  const FastLimits& limits = s.fast.limits[i];
  if (turning(limits, s.poses[i], s.bodies.p_BoBcm[i], path.turn) > 0) {
    Path turn = path;
    turn.travel = Vector::Zero();
    const Collider start = s.collider(i);
    const Pose X_end = moved(turn, s.poses[i], 1);
    const Aabb end = s.methods().bounds(Collider{start.shape, X_end, start.geometry});
    const double between = path.turn.squaredNorm() * limits.reach / 8;
    const Vector reach = Vector::Constant(limits.reach);
    box.lower =
        (box.lower.cwiseMin(end.lower) - Vector::Constant(between)).cwiseMax(path.x - reach);
    box.upper =
        (box.upper.cwiseMax(end.upper) + Vector::Constant(between)).cwiseMin(path.x + reach);
  }
  return swept(box, path.travel, 0);
}

TimeOfImpact meet(const World::State& s, std::size_t a, const Path& A, std::size_t b, const Path& B,
                  ImpactGoal goal) {
  if (keeps_off(s, a, A, b, B)) return {};
  return time_of_impact({s.collider(a), A}, {s.collider(b), B}, goal, s.settings.is_planar);
}

void count(FastBodies& fast, const TimeOfImpact& found) {
  fast.searches += found.iterations > 0 ? 1 : 0;
  fast.unresolved += found.kind == TimeOfImpact::Kind::capped ? 1 : 0;
}

namespace {

/// See BodyArrays; of a body whose shape is round about z. 0 where that axis misses Bcm: then what
/// turns about it is seen.
double axial_share(const BodyTable& bodies, std::size_t i) {
  const Vector &J = bodies.inertia[i], &p = bodies.p_BoBcm[i];
  if (p.x() != 0 || p.y() != 0) return 0;
  const Vector axis =
      bodies.q[i].conjugate() * Vector(bodies.frame(i).q_WB * Vector::UnitZ());  // in P
  Eigen::Index along = 0;
  if (!(axis.cwiseAbs().maxCoeff(&along) > 1 - 1e-12)) return 0;
  const double one = J[(along + 1) % 3], other = J[(along + 2) % 3];
  if (!(one > 0) || std::abs(one - other) > 1e-9 * one) return 0;
  return J[along] / one;
}

}  // namespace

void measure_fast_limits(World::State& s) {
  s.fast.limits.assign(s.bodies.size(), {});
  s.axial_shares.assign(s.bodies.size(), 0);
  s.fast.is_fast.assign(s.bodies.size(), 0);
  for (const std::int32_t slot : s.colliders) {
    const std::size_t i = index(slot);
    const Pose identity;
    const Shape& shape = s.bodies.shape[i];
    const Collider collider{shape, identity, s.geometry(i)};
    FastLimits& limits = s.fast.limits[i];
    limits.thickness = thickness(collider, s.settings.is_planar);
    limits.reach = reach(collider, s.bodies.p_BoBcm[i]);
    if (!std::isfinite(limits.thickness + limits.reach)) {  // half-spaces are never fast
      limits.thickness = std::numeric_limits<double>::infinity();
      continue;
    }
    const double radius = reach(collider, Vector::Zero());
    limits.unevenness = std::max(radius - limits.thickness, 0.0);
    limits.turn_lever = std::sqrt(limits.unevenness * (radius + limits.thickness));
    const bool has_radius = shape.kind == ShapeKind::sphere || shape.kind == ShapeKind::capsule;
    limits.turn_radius = radius - (has_radius ? shape.radius_m() : 0);
    const bool has_axis = shape.kind == ShapeKind::capsule || shape.kind == ShapeKind::cylinder ||
                          shape.kind == ShapeKind::cone;
    limits.is_round = has_axis && !s.settings.is_planar;
    if (limits.is_round) s.axial_shares[i] = axial_share(s.bodies, i);
  }
}

double nearer_by_turning(const World::State& s, std::size_t i) {
  const FastLimits& limits = s.fast.limits[i];
  const Vector& w = s.bodies.w[i];
  if (limits.unevenness == 0 || w.isZero(0)) return 0;
  const double spin = limits.is_round ? w.cross(s.poses[i].R.col(2)).norm() : w.norm();
  return std::min(s.dt * spin * limits.turn_lever, limits.unevenness);
}

void begin_fast_bodies(World::State& s) {
  FastBodies& fast = s.fast;
  if (fast.any) std::fill(fast.is_fast.begin(), fast.is_fast.end(), std::uint8_t{0});
  fast.any = false;
  fast.slots.clear();
  fast.v_start.clear();
  fast.w_start.clear();
  fast.meetings.clear();
  fast.searches = 0;
  fast.stopped = fast.unresolved = 0;
}

namespace {

/// Without looking where its way leads.
bool is_slow(const World::State& s, std::size_t i) {
  const Course course = s.loads.course[i];
  double travel = s.dt * sum(s.bodies.v[i]);
  if (course == Course::falls) travel += 0.5 * s.dt * s.dt * sum(s.gravity_W);
  if (course == Course::pushed) travel += 0.5 * s.dt * s.dt * sum(s.loads.acceleration[i]);
  return is_surely_short(s.fast.limits[i], s.bodies.p_BoBcm[i], travel, s.dt * sum(s.bodies.w[i]));
}

bool note_if_fast_on(World::State& s, std::size_t i, const Path& path) {
  if (!is_far(s, i, path)) return false;
  s.fast.is_fast[i] = 1;
  return true;
}

}  // namespace

void note_if_fast(World::State& s, std::size_t i) {
  if (!is_slow(s, i)) note_if_fast_on(s, i, expected(s, i));
}

void list_fast(World::State& s, std::size_t i) {
  FastBodies& fast = s.fast;
  fast.any = true;
  if (s.bodies.kind[i] != BodyKind::dynamic) return;
  fast.slots.push_back(static_cast<std::int32_t>(i));
  fast.v_start.push_back(s.bodies.v[i]);
  fast.w_start.push_back(s.bodies.w[i]);
}

Aabb box_over_tick(World::State& s, std::size_t i) {
  const double margin = s.margins[i];
  if (s.bodies.kind[i] != BodyKind::fixed && !is_slow(s, i)) {
    const Path path = expected(s, i);
    if (note_if_fast_on(s, i, path)) return swept(box_of_path(s, i, path), Vector::Zero(), margin);
  }
  return swept(s.methods().bounds(s.collider(i)), s.dt * s.bodies.v[i], margin);
}

bool is_hit_expected(const World::State& s, const BodyPair& pair) {
  const std::size_t a = index(pair.a), b = index(pair.b);
  const TimeOfImpact impact = meet(s, a, expected(s, a), b, expected(s, b), ImpactGoal::touch);
  return impact.began_touching || impact.kind != TimeOfImpact::Kind::none;
}

void foresee_impacts(World::State& s, Executor& executor) {
  FastBodies& fast = s.fast;
  if (!fast.any) return;
  for (std::size_t k = 0; k < s.pairs.size(); ++k) {
    const std::size_t a = index(s.pairs[k].a), b = index(s.pairs[k].b);
    if (fast.is_fast[a] != 0 || fast.is_fast[b] != 0) {
      fast.meetings.push_back({k, 0, expected(s, a), expected(s, b)});
    }
  }
  fast.found.resize(fast.meetings.size());
  executor.for_ranges(static_cast<int>(fast.found.size()), 1, [&s](int begin, int end) {
    for (int m = begin; m < end; ++m) {
      Meeting& meeting = s.fast.meetings[index(m)];
      const auto [slot_A, slot_B] = s.pairs[meeting.pair];
      const std::size_t a = index(slot_A), b = index(slot_B);
      TimeOfImpact& impact = s.fast.found[index(m)];
      impact = meet(s, a, meeting.A, b, meeting.B, ImpactGoal::touch);
      if (impact.began_touching || overlap_already(s, meeting.pair)) continue;
      forget_manifolds(s, meeting.pair);
      if (impact.kind == TimeOfImpact::Kind::none) continue;
      meeting.time = impact.time;
      collide_ahead(s, meeting);
    }
  });
  for (const TimeOfImpact& impact : fast.found) count(fast, impact);
  std::erase_if(fast.meetings, [](const Meeting& meeting) { return meeting.time == 0; });
}

void turn_inertia(World::State& s) {
  for (Meeting& meeting : s.fast.meetings) {
    const auto turned = [&](std::int32_t slot, const Path& path) -> Matrix {
      const Matrix R = rotation_exp(meeting.time * path.turn).toRotationMatrix();
      return R * s.inverse_inertia_W[index(slot)] * R.transpose();
    };
    meeting.inverse_inertia_A = turned(s.pairs[meeting.pair].a, meeting.A);
    meeting.inverse_inertia_B = turned(s.pairs[meeting.pair].b, meeting.B);
  }
}

void set_constraint(ContactConstraint& c, const Meeting& meeting, const Manifold& manifold,
                    World::State& s) {
  const auto [slot_A, slot_B] = s.pairs[meeting.pair];
  const auto x = [&](const Path& path) -> Vector { return path.x + meeting.time * path.travel; };
  set_constraint(c, manifold, slot_A, slot_B, s.arrays(), {x(meeting.A), meeting.inverse_inertia_A},
                 {x(meeting.B), meeting.inverse_inertia_B});
  c.is_ahead = true;
  c.turn_A = rotation_exp(meeting.time * meeting.A.turn);
  c.turn_B = rotation_exp(meeting.time * meeting.B.turn);
  // What the solver takes for the separation is to be that of the meeting when the bodies are
  // there.
  const Vector travel = meeting.time * (meeting.B.travel - meeting.A.travel);
  for (ConstraintPoint& p : c.used()) {
    const Vector turned =
        meeting.time * (meeting.B.turn.cross(c.rB(p)) - meeting.A.turn.cross(p.rA));
    p.s0 = std::max(p.s0, p.s0 - c.n.dot(travel + turned));
  }
}

}  // namespace cradle
