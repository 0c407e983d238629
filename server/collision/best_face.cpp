// Which face or side two shapes leave each other by.
//
// Each shape has a few likely directions: its flat faces, and the line of its side, or the point of
// an ellipsoid, that is nearest to the other's centre. Most faces of hulls are passed over by a
// lower bound of their overlap: the other shape reaches behind a face by the ball inside it at
// least, and by its point that was found last.
//
// A face is certainly best if the deepest point behind it, at the depth d, lies r >= d inside its
// sides. For then a disc of radius r around p = d n lies in a face of M, the set of all a - b, and
// along any m at an angle w to n the overlap is at least d cos w + r sin w, no less than d for all
// w up to 90 degrees, and beyond for those with tan((180 - w) / 2) >= d / r. For the rest the balls
// inside the shapes must vouch: M holds one of their radii together, about its centre. (A flat
// shape has no far side to be left by; there it only remains to see that the cores overlap.)
#include "server/collision/best_face.h"

#include <array>
#include <cmath>

#include "server/collision/lead.h"
#include "server/collision/surface.h"

namespace cradle {
namespace {

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
      case ShapeKind::mesh:  // a triangle has its outer face only
        try_flat(shape.triangle->normal, shape.triangle->normal.dot(shape.centre), of, 0);
        break;
      default:
        break;
    }
  }

  /// The flat face of a shape that is nearest to the other's centre, which is at `c`.
  void try_likely(const ConvexShape& shape, const Vector& c, Of of) {
    const double radius = of == Of::A ? pair_.B.inner_radius : pair_.A.inner_radius;
    const auto try_at = [&](const Vector& n, double offset, double along, std::int32_t face) {
      if (offset + radius - along < best_.overlap) try_flat(n, offset, of, face);
    };
    switch (shape.kind) {
      case ShapeKind::box: {
        int axis = 0;
        (shape.size - c.cwiseAbs()).minCoeff(&axis);
        const Vector n = c[axis] < 0 ? Vector(-Vector::Unit(axis)) : Vector::Unit(axis);
        return try_at(n, shape.size[axis], std::abs(c[axis]), 0);
      }
      case ShapeKind::cylinder:
        return try_at({0, 0, c.z() < 0 ? -1.0 : 1.0}, shape.size.y(), std::abs(c.z()), 0);
      case ShapeKind::cone:
        return try_at({0, 0, -1}, shape.size.y(), -c.z(), 0);
      case ShapeKind::hull: {
        const ConvexHull& hull = *shape.hull;
        const std::size_t f = nearest_face(hull, c, of == Of::A ? hints_.A : hints_.B);
        const Vector& n = hull.normals[f];
        return try_at(n, hull.offsets[f], n.dot(c), static_cast<std::int32_t>(f));
      }
      default:
        return;
    }
  }

  const FaceDirection& best() const { return best_; }

 private:
  /// Of the faces at a vertex the one whose plane is nearest to c.
  static std::size_t nearest_face(const ConvexHull& hull, const Vector& c, std::int32_t vertex) {
    const auto v = static_cast<std::size_t>(vertex);
    const auto first = static_cast<std::size_t>(hull.around_first[v]);
    const auto last = static_cast<std::size_t>(hull.around_first[v + 1]);
    std::size_t nearest = 0;
    double least = kInfinity;
    for (std::size_t k = first; k < last; ++k) {
      const auto f =
          static_cast<std::size_t>(hull.face_at[static_cast<std::size_t>(hull.around[k])]);
      const double distance = hull.offsets[f] - hull.normals[f].dot(c);
      if (distance < least) least = distance, nearest = f;
    }
    return nearest;
  }

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
    case ShapeKind::mesh: {
      double least = kInfinity;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector inward = n.cross(shape.triangle->edge(k));
        least = std::min(least, inward.dot(p - shape.triangle->corners[k]));
      }
      return least;
    }
    default:
      return -kInfinity;
  }
}

/// Whether the cores certainly overlap: M holds its point p = overlap n and a ball about its own
/// centre, so all between them, and there the origin may be.
bool is_certain(const ConvexPair& pair, const FaceDirection& face) {
  const double radius = pair.A.inner_radius + pair.B.inner_radius;
  const Vector to_ball = -pair.centre - face.overlap * face.n;  // from p
  const double length2 = to_ball.squaredNorm();
  const double down = -face.n.dot(to_ball);  // along the way from p to the origin
  // The origin is on p's side of the ball's middle, and within the cone from p that touches the
  // ball.
  return face.overlap < down && length2 > radius * radius &&
         down * down > length2 - radius * radius;
}

}  // namespace

FaceDirection best_face(const ConvexPair& pair, SupportHints& hints) {
  BestDirection best(pair, hints);
  best.try_axis(pair.centre);
  best.try_faces(pair.A, pair.centre + pair.A.centre, FaceDirection::Of::A);
  best.try_faces(pair.B, pair.R.transpose() * (pair.A.centre - pair.t), FaceDirection::Of::B);
  if (!std::isfinite(best.best().overlap)) best.try_direction(Vector::UnitZ());
  return best.best();
}

FaceDirection likely_face(const ConvexPair& pair, SupportHints& hints) {
  BestDirection best(pair, hints);
  best.try_likely(pair.A, pair.centre + pair.A.centre, FaceDirection::Of::A);
  best.try_likely(pair.B, pair.R.transpose() * (pair.A.centre - pair.t), FaceDirection::Of::B);
  return best.best();
}

double inside_face(const ConvexPair& pair, const FaceDirection& face) {
  if (face.face_of == FaceDirection::Of::A) {
    return inside_face(pair.A, face.n, face.face, face.deepest);
  }
  return inside_face(pair.B, -(pair.R.transpose() * face.n), face.face,
                     pair.R.transpose() * (face.deepest - pair.t));
}

std::optional<LeastOverlap> certain_at_face(const ConvexPair& pair, LeastOverlap found,
                                            FaceDirection::Of face_of, double lead_wanted) {
  FaceDirection face;
  face.n = found.n;
  face.overlap = found.overlap;
  face.face_of = face_of;
  const bool is_of_A = face_of == FaceDirection::Of::A;
  face.deepest = is_of_A ? Vector(found.p_A - found.overlap * found.n) : found.p_A;
  if (face.overlap > 0) {
    if (!is_best(pair, face)) return std::nullopt;
    if (lead_wanted > 0 && is_best(pair, face, lead_wanted / 2)) found.lead = lead_wanted;
    return found;
  }
  // Apart: the closest points are those if the foot is on the face.
  if (!(inside_face(pair, face) >= 0)) return std::nullopt;
  found.lead = lead_by_turn(-face.overlap);
  return found;
}

bool is_best(const ConvexPair& pair, const FaceDirection& face, double slack) {
  using Of = FaceDirection::Of;
  if (face.face_of == Of::nothing || !(face.overlap > 0)) return false;
  const double d = face.overlap + slack, r = inside_face(pair, face) - slack;
  if (!(r >= d && face.overlap > slack)) return false;
  if (pair.has_flat()) return slack == 0 && is_certain(pair, face);
  // The ball's centre is `below` the disc's, as n goes, and `aside` of it.
  const double middle = face.n.dot(pair.centre), below = middle - slack;
  const double aside2 = pair.centre.squaredNorm() - middle * middle;
  const double reach = pair.A.inner_radius + pair.B.inner_radius;
  const double sine = 2 * d * r, cosine = r * r - d * d, one = r * r + d * d;  // but for a factor
  return below >= 0 &&
         below * cosine + (reach - d) * one >= (std::sqrt(std::max(0.0, aside2)) + slack) * sine;
}

}  // namespace cradle
