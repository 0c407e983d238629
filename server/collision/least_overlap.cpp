// The direction of least overlap of two convex cores.
//
// Symbols, in A's frame: M the set of all a - b, h(n) = max over M of n . m its support function,
// the overlap along n. If the cores are apart, the best n is that of the closest points. If they
// overlap it is the unit vector with the least h: the nearest point of M's surface lies there.
//
// Method: let n be any direction. B moved out along n by h(n) + e is apart from A by e at least.
// The closest points then give a direction n' with h(n') <= h(n) cos(n, n'): this follows from
// |q - p| >= e for q = (h + e) n and its foot p on M. So the steps descend, and rest only where the
// foot lies on n: where a ball about the origin touches M from inside. Where M is flat one step
// arrives; where it is round with radius R, an error shrinks by (h + e) / (R + e) a step.
// That is a local minimum. The descent begins at the best of the directions in which shapes use to
// leave each other: their faces and sides; and where a face is not certainly best, also at the
// direction of the closest points with B moved away a little.
//
// Where we differ from the expanding polytope algorithm (van den Bergen 2001): only distances of
// sets that are apart are asked for, so nothing degenerates where faces kiss, and curved shapes
// need no triangles; but a deep overlap may end in another local minimum than the least. Cost: 1 to
// 3 distances, each about 0.2 us.
#include <cmath>

#include "server/collision/convex_pair.h"

namespace cradle {
namespace {

constexpr int kStepsMax = 32;
constexpr double kStill = 1e-9;         // rad: a step so small ends the descent
constexpr double kPartingShare = 0.15;  // of the way between the centres, for the second beginning

struct Direction {
  Vector n = Vector::Zero();
  double overlap = std::numeric_limits<double>::infinity();
};

/// Tries directions and keeps the best.
class BestDirection {
 public:
  BestDirection(const ConvexPair& pair, SupportHints& hints) : pair_(pair), hints_(hints) {}

  /// A unit vector, turned to the side on which B's centre is.
  void try_axis(const Vector& n) { try_direction(n.dot(pair_.centre) < 0 ? Vector(-n) : n); }

  void try_direction(const Vector& n) {
    // What overlaps at least by the balls inside need not be looked at.
    const double least = pair_.A.inner_radius + pair_.B.inner_radius - n.dot(pair_.centre);
    if (!(least < best_.overlap)) return;
    const double overlap = core_overlap(pair_, n, hints_);
    if (overlap < best_.overlap) best_ = {n, overlap};
  }

  /// Any vector but zero.
  void try_vector(const Vector& d) {
    const double length2 = d.squaredNorm();
    if (length2 > 1e-30) try_axis(d / std::sqrt(length2));
  }

  const Direction& best() const { return best_; }

 private:
  const ConvexPair& pair_;
  SupportHints& hints_;
  Direction best_;
};

/// The faces and sides of a shape, in its frame, by which another one whose centre lies at `c` may
/// leave; `emit` is called with unit vectors out of the shape.
template <typename Emit>
void for_faces(const ConvexShape& shape, const Vector& c, Emit emit) {
  const auto emit_radial = [&](double out, double up) {
    const double across = std::sqrt(c.x() * c.x() + c.y() * c.y());
    const double ex = across > 0 ? c.x() / across : 1, ey = across > 0 ? c.y() / across : 0;
    emit(Vector(out * ex, out * ey, up));
  };
  switch (shape.kind) {
    case ShapeKind::box:
      for (int axis = 0; axis < 3; ++axis) {
        emit(c[axis] < 0 ? Vector(-Vector::Unit(axis)) : Vector::Unit(axis));
      }
      break;
    case ShapeKind::capsule:
      emit_radial(1, 0);
      break;
    case ShapeKind::cylinder:
      emit(Vector(0, 0, c.z() < 0 ? -1 : 1));
      emit_radial(1, 0);
      break;
    case ShapeKind::cone: {
      const double r = shape.size.x(), h = 2 * shape.size.y(), slant = std::sqrt(r * r + h * h);
      emit(Vector(0, 0, -1));
      emit_radial(h / slant, r / slant);
      break;
    }
    case ShapeKind::ellipsoid: {
      const Vector out = c.cwiseQuotient(shape.size).cwiseQuotient(shape.size);
      const double length = out.norm();
      if (length > 0) emit(Vector(out / length));
      int flattest = 0;
      shape.size.minCoeff(&flattest);
      emit(c[flattest] < 0 ? Vector(-Vector::Unit(flattest)) : Vector::Unit(flattest));
      break;
    }
    case ShapeKind::hull:
      for (const std::int32_t f : shape.hull->widest) {
        emit(shape.hull->normals[static_cast<std::size_t>(f)]);
      }
      break;
    default:
      break;
  }
}

bool has_axis(const ConvexShape& shape) {
  return shape.kind == ShapeKind::capsule || shape.kind == ShapeKind::cylinder;
}

Direction best_face(const ConvexPair& pair, SupportHints& hints) {
  BestDirection best(pair, hints);
  best.try_vector(pair.centre);
  const Vector from_A = pair.centre + pair.A.centre;  // B's centre, as A sees it
  for_faces(pair.A, from_A, [&](const Vector& n) { best.try_direction(n); });
  const Vector from_B = pair.R.transpose() * (pair.A.centre - pair.t);
  for_faces(pair.B, from_B, [&](const Vector& n) { best.try_direction(-(pair.R * n)); });
  if (has_axis(pair.A) && has_axis(pair.B)) best.try_vector(Vector::UnitZ().cross(pair.R.col(2)));
  if (!std::isfinite(best.best().overlap)) best.try_direction(Vector::UnitZ());
  return best.best();
}

/// Down from a direction to a local minimum.
LeastOverlap descend(const ConvexPair& pair, Direction from, SupportHints& hints) {
  const double e = pair.small_length();
  LeastOverlap best{true, from.n, from.overlap, Vector::Zero()};
  for (int step = 0; step < kStepsMax; ++step) {
    const Closest found = closest(pair, (best.overlap + e) * best.n, best.n,
                                  std::numeric_limits<double>::infinity(), hints);
    if (found.kind != Closest::Kind::apart) break;
    const double overlap = core_overlap(pair, found.n, hints);
    const double turned = (found.n - best.n).norm();
    best.p_A = found.p_A;
    if (overlap > best.overlap) break;
    best.n = found.n;
    best.overlap = overlap;
    if (turned < kStill) break;
  }
  return best;
}

/// A direction for the second beginning: good where edges cross, which no face tells.
Direction parting(const ConvexPair& pair, SupportHints& hints) {
  const double distance = pair.centre.norm();
  if (!(distance > pair.small_length())) return {};
  const Vector along = pair.centre / distance;
  const Closest found = closest(pair, kPartingShare * pair.centre, along,
                                std::numeric_limits<double>::infinity(), hints);
  const Vector n = found.kind == Closest::Kind::apart ? found.n : along;
  return {n, core_overlap(pair, n, hints)};
}

}  // namespace

ConvexPair::ConvexPair(const Collider& collider_A, const Collider& collider_B)
    : A(collider_A),
      B(collider_B),
      R(collider_A.X_WB.R.transpose() * collider_B.X_WB.R),
      t(collider_A.X_WB.R.transpose() * (collider_B.X_WB.x - collider_A.X_WB.x)),
      centre(t + R * B.centre - A.centre) {}

LeastOverlap least_overlap(const ConvexPair& pair, double limit, SupportHints& hints) {
  const Direction face = best_face(pair, hints);
  if (-face.overlap > limit) return {};
  const Closest found = closest(pair, Vector::Zero(), face.n, limit, hints);
  if (found.kind == Closest::Kind::beyond_limit) return {};
  if (found.kind == Closest::Kind::apart) {
    const Direction n{found.n, core_overlap(pair, found.n, hints)};
    if (found.distance > pair.small_length()) return {true, n.n, n.overlap, found.p_A};
    return descend(pair, n, hints);  // so near that the direction is better found from farther off
  }
  const LeastOverlap best = descend(pair, face, hints);
  const Direction second = parting(pair, hints);
  if (!std::isfinite(second.overlap)) return best;
  const LeastOverlap other = descend(pair, second, hints);
  return other.overlap < best.overlap ? other : best;
}

}  // namespace cradle
