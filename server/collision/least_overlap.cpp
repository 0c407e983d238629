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
// (Where steps shrink steadily, their limit is guessed, and taken if it is lower; where they hardly
// shrink, as in deep overlaps, they are stretched.)
// That is a local minimum. The descent begins at the best of the directions in which shapes use to
// leave each other: their faces and sides; and where a face is not certainly best, also at the
// direction of the closest points with B moved away a little.
//
// Where we differ from the expanding polytope algorithm (van den Bergen 2001): only distances of
// sets that are apart are asked for, so nothing degenerates where faces kiss, and curved shapes
// need no triangles; but a deep overlap may end in another local minimum than the least. Cost: 1 to
// 3 distances, each about 0.2 us.
#include <array>
#include <cmath>

#include "server/collision/convex_pair.h"

namespace cradle {
namespace {

constexpr int kStepsMax = 32;
constexpr double kStill = 1e-5;         // rad: a step so small ends the descent; the error is less
constexpr double kShallowShare = 0.05;  // of a thickness: deeper overlaps are sought from two sides
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPartingShare = 0.15;  // of the way between the centres, for the second beginning

constexpr double kDeepStill = 100;
constexpr double kRough = 1e-2;  // rad: while steps are larger, closest points need not be exact
constexpr double kRoughGap = 1e-4;
constexpr int kRoughSteps = 6;
constexpr double kSlow = 0.3;  // of the last step: one that shrinks less is stretched

struct Direction {
  Vector n = Vector::Zero();
  double overlap = kInfinity;
};

/// A direction in which one shape has a flat face, and what reaches deepest behind it.
struct FaceDirection : Direction {
  enum class Of { nothing, A, B } face_of = Of::nothing;
  std::int32_t face = 0;            ///< of a hull its number
  Vector deepest = Vector::Zero();  ///< point of the other shape, in A
};

/// Tries directions and keeps the best.
class BestDirection {
 public:
  using Of = FaceDirection::Of;

  BestDirection(const ConvexPair& pair, SupportHints& hints)
      : pair_(pair), hints_(hints), inner_(pair.A.inner_radius + pair.B.inner_radius) {}

  /// A unit vector.
  void try_direction(const Vector& n) {
    // What overlaps at least by the balls inside need not be looked at.
    if (!(inner_ - n.dot(pair_.centre) < best_.overlap)) return;
    const double overlap = core_overlap(pair_, n, hints_);
    if (!(overlap < best_.overlap)) return;
    best_.n = n;
    best_.overlap = overlap;
    best_.face_of = Of::nothing;
  }

  /// Any vector but zero, turned to the side on which B's centre is.
  void try_axis(const Vector& d) {
    const double length2 = d.squaredNorm();
    if (!(length2 > 1e-30)) return;
    const double scale = (d.dot(pair_.centre) < 0 ? -1 : 1) / std::sqrt(length2);
    try_direction(d * scale);
  }

  /// The faces of a shape, toward the other whose centre is at `c` in the shape's frame.
  void try_faces(const ConvexShape& shape, const Vector& c, Of of) {
    const double across = std::sqrt(c.x() * c.x() + c.y() * c.y());
    const double ex = across > 0 ? c.x() / across : 1, ey = across > 0 ? c.y() / across : 0;
    const double up = c.z() < 0 ? -1 : 1;
    switch (shape.kind) {
      case ShapeKind::box:
        for (int axis = 0; axis < 3; ++axis) {
          const Vector n = c[axis] < 0 ? Vector(-Vector::Unit(axis)) : Vector::Unit(axis);
          try_flat(n, shape.size[axis], of, 0);
        }
        break;
      case ShapeKind::capsule:
        try_normal({ex, ey, 0}, of);
        break;
      case ShapeKind::cylinder:
        try_flat({0, 0, up}, shape.size.y(), of, 0);
        try_normal({ex, ey, 0}, of);
        break;
      case ShapeKind::cone: {
        const double r = shape.size.x(), h = 2 * shape.size.y(), slant = std::sqrt(r * r + h * h);
        try_flat({0, 0, -1}, shape.size.y(), of, 0);
        try_normal({ex * h / slant, ey * h / slant, r / slant}, of);
        break;
      }
      case ShapeKind::ellipsoid:
        try_faces_of_ellipsoid(shape, c, of);
        break;
      case ShapeKind::hull:
        try_faces_of_hull(*shape.hull, c, of);
        break;
      default:
        break;
    }
  }

  const FaceDirection& best() const { return best_; }

 private:
  /// A direction out of the shape, in its frame.
  void try_normal(const Vector& n, Of of) {
    try_direction(of == Of::A ? n : Vector(-(pair_.R * n)));
  }

  /// A flat face of the shape in the plane n . p = offset, in its frame: only the other shape's
  /// deepest point behind it is sought.
  void try_flat(const Vector& n, double offset, Of of, std::int32_t face) {
    Vector p;  // deepest, in the frame of the shape that has the face
    if (of == Of::A) {
      p = pair_.R * pair_.B.support(-(pair_.R.transpose() * n), hints_.B) + pair_.t;
    } else {
      p = pair_.R.transpose() * (pair_.A.support(-(pair_.R * n), hints_.A) - pair_.t);
    }
    last_deepest_ = p;
    const double overlap = offset - n.dot(p);
    if (!(overlap < best_.overlap)) return;
    best_.overlap = overlap;
    best_.n = of == Of::A ? n : Vector(-(pair_.R * n));
    best_.face_of = of;
    best_.face = face;
    best_.deepest = of == Of::A ? p : Vector(pair_.R * p + pair_.t);
  }

  void try_faces_of_ellipsoid(const ConvexShape& shape, const Vector& c, Of of) {
    const Vector out = c.cwiseQuotient(shape.size).cwiseQuotient(shape.size);
    const double length = out.norm();
    if (length > 0) try_normal(out / length, of);
    int flattest = 0;
    shape.size.minCoeff(&flattest);
    const Vector axis = Vector::Unit(flattest);
    try_normal(c[flattest] < 0 ? Vector(-axis) : axis, of);
  }

  /// The most promising first, so that few others need be looked at: the other shape reaches behind
  /// a face by the ball inside it at least, and by its point that was found last.
  void try_faces_of_hull(const ConvexHull& hull, const Vector& c, Of of) {
    const double radius = of == Of::A ? pair_.B.inner_radius : pair_.A.inner_radius;
    std::array<double, kFacesMax> bounds;
    const std::size_t count = std::min(kFacesMax, hull.widest.size());
    std::size_t first = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const auto f = static_cast<std::size_t>(hull.widest[i]);
      bounds[i] = hull.offsets[f] + radius - hull.normals[f].dot(c);
      if (bounds[i] < bounds[first]) first = i;
    }
    const auto try_face = [&](std::size_t i) {
      const auto f = static_cast<std::size_t>(hull.widest[i]);
      try_flat(hull.normals[f], hull.offsets[f], of, hull.widest[i]);
    };
    try_face(first);
    for (std::size_t i = 0; i < count; ++i) {
      if (i == first || !(bounds[i] < best_.overlap)) continue;
      const auto f = static_cast<std::size_t>(hull.widest[i]);
      if (hull.offsets[f] - hull.normals[f].dot(last_deepest_) < best_.overlap) try_face(i);
    }
  }

  static constexpr std::size_t kFacesMax = 256;

  const ConvexPair& pair_;
  SupportHints& hints_;
  const double inner_;
  FaceDirection best_;
  Vector last_deepest_ = Vector::Zero();  ///< of the other shape, in the frame of the face
};

bool has_axis(const ConvexShape& shape) {
  return shape.kind == ShapeKind::capsule || shape.kind == ShapeKind::cylinder;
}

FaceDirection best_face(const ConvexPair& pair, SupportHints& hints) {
  BestDirection best(pair, hints);
  best.try_axis(pair.centre);
  best.try_faces(pair.A, pair.centre + pair.A.centre, FaceDirection::Of::A);
  best.try_faces(pair.B, pair.R.transpose() * (pair.A.centre - pair.t), FaceDirection::Of::B);
  if (has_axis(pair.A) && has_axis(pair.B)) best.try_axis(Vector::UnitZ().cross(pair.R.col(2)));
  if (!std::isfinite(best.best().overlap)) best.try_direction(Vector::UnitZ());
  return best.best();
}

/// How far inside the sides of its flat face that looks along `n` a shape has the point `p`.
double inside_face(const ConvexShape& shape, const Vector& n, std::int32_t face, const Vector& p) {
  switch (shape.kind) {
    case ShapeKind::box: {
      double least = kInfinity;
      for (int i = 0; i < 3; ++i) {
        if (std::abs(n[i]) < 0.5) least = std::min(least, shape.size[i] - std::abs(p[i]));
      }
      return least;
    }
    case ShapeKind::cylinder:
    case ShapeKind::cone:
      return shape.size.x() - p.head<2>().norm();
    case ShapeKind::hull: {
      double least = kInfinity;
      const auto loop = shape.hull->face(static_cast<std::size_t>(face));
      for (std::size_t k = 0; k < loop.size(); ++k) {
        const Vector& a = shape.hull->vertices[static_cast<std::size_t>(loop[k])];
        const Vector& b =
            shape.hull->vertices[static_cast<std::size_t>(loop[k + 1 < loop.size() ? k + 1 : 0])];
        const Vector inward = n.cross(b - a);
        least = std::min(least, inward.dot(p - a) / inward.norm());
      }
      return least;
    }
    default:
      return -kInfinity;
  }
}

/// Where the last steps lead to if they shrink steadily (Anderson 1965, of depth two: the tangent
/// plane has two dimensions): from directions n and the directions g that came of them.
class Extrapolation {
 public:
  void add(const Vector& n, const Vector& g) {
    f_[2] = f_[1], f_[1] = f_[0], f_[0] = g - n;
    g_[2] = g_[1], g_[1] = g_[0], g_[0] = g;
    ++count_;
  }

  /// False if they lead nowhere.
  bool guess(Vector& n) const {
    if (count_ < 2) return false;
    const Vector u = f_[0] - f_[1], v = count_ < 3 ? Vector(Vector::Zero()) : Vector(f_[1] - f_[2]);
    const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
    const double uf = u.dot(f_[0]), vf = v.dot(f_[0]);
    const double determinant = uu * vv - uv * uv;
    double a = 0, b = 0;
    if (determinant > 1e-6 * uu * vv) {
      a = (uf * vv - vf * uv) / determinant;
      b = (vf * uu - uf * uv) / determinant;
    } else if (uu > 0) {
      a = uf / uu;
    } else {
      return false;
    }
    n = g_[0] - a * (g_[0] - g_[1]);
    if (b != 0) n -= b * (g_[1] - g_[2]);
    const double length = n.norm();
    n /= length;
    return length > 0.1;
  }

 private:
  std::array<Vector, 3> f_{Vector::Zero(), Vector::Zero(), Vector::Zero()}, g_ = f_;
  int count_ = 0;
};

/// Down from a direction to a local minimum.
class Descent {
 public:
  Descent(const ConvexPair& pair, Simplex& simplex, SupportHints& hints)
      : pair_(pair), simplex_(simplex), hints_(hints) {}

  LeastOverlap from(const Direction& begin) {
    best_ = {true, begin.n, begin.overlap, Vector::Zero()};
    const double e = pair_.small_length();
    const double thickness = std::min(pair_.A.thickness, pair_.B.thickness);
    const double gap = simplex_.gap;
    bool is_rough = true;
    double last_turn = kInfinity;
    for (int step = 0; step < kStepsMax; ++step) {
      simplex_.gap = is_rough ? kRoughGap : gap;
      const Closest found =
          closest(pair_, (best_.overlap + e) * best_.n, best_.n, kInfinity, simplex_, hints_);
      if (found.kind != Closest::Kind::apart) break;
      best_.p_A = found.p_A;
      const Vector begin_n = best_.n;
      const double turn = (found.n - begin_n).norm();
      const bool is_lower = take_if_lower(found.n);
      if (!is_lower && !is_rough) break;
      // The deeper, the less a small step says about what is left.
      const double still = kStill / (1 + kDeepStill * std::max(0.0, best_.overlap) / thickness);
      if (turn < still && !is_rough) break;
      const bool was_rough = is_rough;
      is_rough = is_rough && is_lower && turn > kRough && step < kRoughSteps;
      if (was_rough && !is_lower) continue;
      if (!was_rough) {
        extrapolation_.add(begin_n, found.n);
        Vector guess;
        if (extrapolation_.guess(guess) && take_if_lower(guess)) continue;
      }
      if (turn > kSlow * last_turn) stretch(begin_n, found.n);
      last_turn = turn;
    }
    simplex_.gap = gap;
    return best_;
  }

 private:
  bool take_if_lower(const Vector& n) {
    const double overlap = core_overlap(pair_, n, hints_);
    if (!(overlap <= best_.overlap)) return false;
    best_.n = n;
    best_.overlap = overlap;
    return true;
  }

  /// Farther the same way, as long as it goes down.
  void stretch(const Vector& n, const Vector& g) {
    for (double factor = 2; factor < 1000; factor *= 2) {
      const double before = best_.overlap;
      if (!take_if_lower((n + factor * (g - n)).normalized()) || best_.overlap == before) break;
    }
  }

  const ConvexPair& pair_;
  Simplex& simplex_;
  SupportHints& hints_;
  Extrapolation extrapolation_;
  LeastOverlap best_;
};

LeastOverlap descend(const ConvexPair& pair, const Direction& from, Simplex& simplex,
                     SupportHints& hints) {
  return Descent(pair, simplex, hints).from(from);
}

/// A direction for the second beginning: good where edges cross, which no face tells.
Direction parting(const ConvexPair& pair, Simplex& simplex, SupportHints& hints) {
  const double distance = pair.centre.norm();
  if (!(distance > pair.small_length())) return {};
  const Vector along = pair.centre / distance;
  const double gap = simplex.gap;
  simplex.gap = kRoughGap;
  const Closest found =
      closest(pair, kPartingShare * pair.centre, along, kInfinity, simplex, hints);
  simplex.gap = gap;
  const Vector n = found.kind == Closest::Kind::apart ? found.n : along;
  return {n, core_overlap(pair, n, hints)};
}

/// Whether the cores certainly overlap: M holds its point p = overlap n and a ball about its own
/// centre, so all between them, and there the origin may be.
bool is_certain(const ConvexPair& pair, const LeastOverlap& found) {
  const double radius = pair.A.inner_radius + pair.B.inner_radius;
  const Vector to_ball = -pair.centre - found.overlap * found.n;  // from p
  const double length2 = to_ball.squaredNorm();
  const double down = -found.n.dot(to_ball);  // along the way from p to the origin
  // The origin is on p's side of the ball's middle, and within the cone from p that touches the
  // ball.
  return found.overlap > 0 && found.overlap < down && length2 > radius * radius &&
         down * down > length2 - radius * radius;
}

/// Whether a face is certainly the best side to leave by. A disc of radius r around p = d n lies in
/// a face of M; along any m at an angle a to n, the overlap then is at least d cos a + r sin a,
/// which for r >= d is no less than d.
bool is_best(const ConvexPair& pair, const FaceDirection& face) {
  using Of = FaceDirection::Of;
  if (face.face_of == Of::nothing || !(face.overlap > 0)) return false;
  const double inside = face.face_of == Of::A
                            ? inside_face(pair.A, face.n, face.face, face.deepest)
                            : inside_face(pair.B, -(pair.R.transpose() * face.n), face.face,
                                          pair.R.transpose() * (face.deepest - pair.t));
  return inside >= face.overlap;
}

LeastOverlap least_overlap_of_close(const ConvexPair& pair, const FaceDirection& face, double limit,
                                    SupportHints& hints) {
  if (is_best(pair, face)) {
    const bool of_A = face.face_of == FaceDirection::Of::A;
    const LeastOverlap best{true, face.n, face.overlap,
                            of_A ? Vector(face.deepest + face.overlap * face.n) : face.deepest};
    if (is_certain(pair, best)) return best;
  }
  Simplex parted, from_face;
  const Direction part = parting(pair, parted, hints);
  const bool part_first = part.overlap < face.overlap;
  LeastOverlap best =
      part_first ? descend(pair, part, parted, hints) : descend(pair, face, from_face, hints);
  if (!is_certain(pair, best)) {
    Simplex simplex;
    const Closest found = closest(pair, Vector::Zero(), best.n, limit, simplex, hints);
    if (found.kind == Closest::Kind::beyond_limit) return {};
    if (found.kind == Closest::Kind::apart) {
      const Direction n{found.n, core_overlap(pair, found.n, hints)};
      if (found.distance > pair.small_length()) return {true, n.n, n.overlap, found.p_A};
      return descend(pair, n, simplex, hints);
    }
  }
  const double deep = kShallowShare * std::min(pair.A.thickness, pair.B.thickness);
  if (best.overlap < deep || !std::isfinite(part.overlap)) return best;
  const LeastOverlap other =
      part_first ? descend(pair, face, from_face, hints) : descend(pair, part, parted, hints);
  return other.overlap < best.overlap ? other : best;
}

}  // namespace

ConvexPair::ConvexPair(const Collider& collider_A, const Collider& collider_B)
    : A(collider_A),
      B(collider_B),
      R(collider_A.X_WB.R.transpose() * collider_B.X_WB.R),
      t(collider_A.X_WB.R.transpose() * (collider_B.X_WB.x - collider_A.X_WB.x)),
      centre(t + R * B.centre - A.centre) {}

LeastOverlap least_overlap(const ConvexPair& pair, double limit, SupportHints& hints) {
  const FaceDirection face = best_face(pair, hints);
  if (-face.overlap > limit) return {};
  const double small = pair.small_length();
  if (face.overlap < -small || pair.radii() > 0) {  // the cores are apart, or probably
    Simplex simplex;
    const Closest found = closest(pair, Vector::Zero(), face.n, limit, simplex, hints);
    if (found.kind == Closest::Kind::beyond_limit) return {};
    if (found.kind == Closest::Kind::apart && found.distance > small) {
      return {true, found.n, core_overlap(pair, found.n, hints), found.p_A};
    }
  }
  return least_overlap_of_close(pair, face, limit, hints);
}

}  // namespace cradle
