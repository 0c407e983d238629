/// A polytope inside M, the set of all a - b, that grows toward the part of M's surface nearest to
/// the origin. Private to this folder.
#pragma once

#include "server/collision/convex_pair.h"

namespace cradle {

class ExpandingPolytope {
 public:
  static constexpr std::size_t kCornersMax = 48;
  static constexpr int kWithoutFirst = 2;

  /// Of a face, from its corner `side` to the next.
  struct Edge {
    std::uint8_t face, side;
  };

  struct alignas(64) Face {  // a line of the cache
    Vector n;                ///< unit, outward
    double distance;  ///< of its plane from the origin along n; negative: the origin is outside
    std::array<std::uint8_t, 3> corners;  ///< counter-clockwise as seen from outside
    std::array<Edge, 3> across;           ///< the same edges, as the faces beyond them have them
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

  /// The foot of the origin is on the face, not beside it.
  bool has_foot(const Face& face) const;
  /// Of a face of M, which the polytope has in triangles: the triangle with the foot of the origin,
  /// or nearest to it. -1: it has none of it.
  int face_at_foot(const Vector& n, double distance) const;
  /// The point of A at the foot of the origin on the face; clamped to the face.
  Vector foot_on_A(const Face& face) const;
  std::array<Difference, 3> corners_of(const Face& face) const {
    return {corners_[face.corners[0]], corners_[face.corners[1]], corners_[face.corners[2]]};
  }
  const Difference& corner(std::uint8_t k) const { return corners_[k]; }

 private:
  static constexpr std::size_t kFacesMax = 4 * kCornersMax;  // in all, removed ones among them
  static constexpr double kClosed = 1e300;

  /// The edges around a hole, in order, as the faces that stay have them.
  struct Rim {
    std::array<Edge, kCornersMax> edges;
    std::size_t count = 0;
    bool is_broken = false;  // by rounding

    void add(const Edge& edge) {
      is_broken = is_broken || count == edges.size();
      if (!is_broken) edges[count++] = edge;
    }
  };

  /// Of a face's corners in the foot of the origin: below zero where it is beyond an edge.
  std::array<double, 3> weights_at_foot(const Face& face) const;
  std::uint8_t start_of(const Edge& edge) const { return faces_[edge.face].corners[edge.side]; }
  std::uint8_t end_of(const Edge& edge) const {
    return faces_[edge.face].corners[edge.side == 2 ? 0 : edge.side + 1];
  }

  /// Its number; its plane has yet to be set.
  std::size_t add_face(std::uint8_t a, std::uint8_t b, std::uint8_t c);
  /// Of all faces from `first` on. False if one is flat.
  bool set_planes(std::size_t first);
  void set_plane(std::size_t f, const Vector& n, double distance);
  Edge& across(const Edge& edge) { return faces_[edge.face].across[edge.side]; }
  void join(const Edge& edge, const Edge& other) {
    across(edge) = other;
    across(other) = edge;
  }

  void remove(std::uint8_t f) {
    is_removed_[f] = true;
    close(f);
  }
  /// Removes the face of an edge if it sees `w`, and those beyond it that do; else the edge is of
  /// the rim.
  void remove_seeing(const Vector& w, double level, const Edge& edge, Rim& rim);
  /// Faces from the rim to a corner. False as in `expand`.
  bool fill_hole(const Rim& rim, std::uint8_t top);

  std::array<Difference, kCornersMax> corners_;
  std::array<Face, kFacesMax> faces_;
  /// The distance with the face's number in its last bits, so that the least of them tells both; or
  /// kClosed. Filled up to a multiple of four.
  std::array<double, kFacesMax> keys_;
  std::array<bool, kFacesMax> is_removed_;
  std::size_t corner_count_ = 0, face_count_ = 0;
};

}  // namespace cradle
