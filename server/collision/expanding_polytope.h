/// A polytope inside M, the set of all a - b, that grows toward the part of M's surface nearest to
/// the origin. Private to this folder.
#pragma once

#include "server/collision/convex_pair.h"

namespace cradle {

class ExpandingPolytope {
 public:
  static constexpr std::size_t kCornersMax = 48;
  static constexpr int kWithoutFirst = 2;

  struct Face {
    Vector n;         ///< unit, outward
    double distance;  ///< of its plane from the origin along n; negative: the origin is outside
  };

  /// False if the tetrahedron of the corners is flat. Face kWithoutFirst is across from the first.
  bool begin(const std::array<Difference, 4>& corners);

  /// The face whose plane is nearest to the origin, of those nearer than `bound`; -1: none. To
  /// 6e-14 of the distance.
  int nearest(double bound) const;
  const Face& face(int f) const { return faces_[static_cast<std::size_t>(f)]; }

  /// The face is not to be found again: it lies in M's surface.
  void close(int f) { keys_[static_cast<std::size_t>(f)] = kClosed; }

  /// Takes in a corner that is beyond the face. False if there is no room for it, or if rounding
  /// makes a face of it flat; then the polytope is of no more use.
  bool expand(int f, const Difference& corner);

  /// The face at the foot of the origin on a face of M, which the polytope has in triangles: `f`
  /// if its triangle has the foot, or that which has it, or is nearest to it. -1: it has none of
  /// it.
  int face_at_foot(int f, const Vector& n, double distance) const;
  /// The point of A at the foot of the origin on the face; clamped to the face.
  Vector foot_on_A(int f) const;
  std::array<Difference, 3> corners_of(int f) const {
    return {corner(edge_of(f)), corner(edge_of(f) + 1), corner(edge_of(f) + 2)};
  }
  /// Of a face's corners in the foot of the origin: below zero where it is beyond an edge.
  std::array<double, 3> weights_at_foot(int f) const;
  bool has_foot(int f) const { return std::ranges::min(weights_at_foot(f)) >= 0; }
  /// Whether the face is there, and the point beyond it by more than `sure`, m.
  bool sees(int f, const Vector& w, double sure) const {
    const Face& seen = face(f);
    return !is_removed_[static_cast<std::size_t>(f)] && seen.n.dot(w) - seen.distance > sure;
  }
  /// Some face that the point is beyond so; -1: none.
  int face_seen_from(const Vector& w, double sure) const {
    for (int f = 0; f < static_cast<int>(face_count_); ++f) {
      if (sees(f, w, sure)) return f;
    }
    return -1;
  }

 private:
  static constexpr std::size_t kFacesMax = 4 * kCornersMax;  // in all, removed ones among them
  static constexpr double kClosed = 1e300;

  /// Side k of face f, from its corner k to the next: 4 f + k. The corner that follows the third is
  /// there again as the fourth.
  using Edge = std::size_t;
  static Edge edge_of(int f) { return 4 * static_cast<Edge>(f); }
  static Edge next_of(Edge edge) { return edge % 4 == 2 ? edge - 2 : edge + 1; }
  const Difference& corner(Edge edge) const { return corners_[start_[edge]]; }

  /// Its first edge; its plane has yet to be set.
  Edge add_face(std::uint8_t a, std::uint8_t b, std::uint8_t c);
  /// Of all faces from `first` on. False if one is flat.
  bool set_planes(std::size_t first);
  void set_plane(std::size_t f, const Vector& n, double distance);
  void join(Edge edge, Edge other) {
    across_[edge] = static_cast<std::uint16_t>(other);
    across_[other] = static_cast<std::uint16_t>(edge);
  }

  void remove(std::size_t f) {
    is_removed_[f] = true;
    keys_[f] = kClosed;
  }
  /// From an edge of a face that has been removed: removes what is beyond it, too, if `w` is above
  /// that by more than `level`, and so on; else puts a face from the edge to the corner taken in
  /// last. New faces come in order around the hole.
  void look_beyond(const Vector& w, double level, Edge edge);
  /// Joins the new faces to each other. False as in `expand`.
  bool close_ring(std::size_t first);

  std::array<Difference, kCornersMax> corners_;
  std::array<Face, kFacesMax> faces_;
  std::array<std::uint8_t, 4 * kFacesMax> start_;    // corners of edges, counter-clockwise
  std::array<std::uint16_t, 4 * kFacesMax> across_;  // the same edge of the face beyond it
  /// The distance with the face's number in its last bits, so that the least of them tells both; or
  /// kClosed. Filled up to a multiple of four.
  std::array<double, kFacesMax> keys_;
  std::array<bool, kFacesMax> is_removed_;
  std::size_t corner_count_ = 0, face_count_ = 0;
};

}  // namespace cradle
