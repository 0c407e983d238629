/// The direction of least overlap of two cores with corners only, sought one support point at a
/// time, so that several searches can go on side by side: each waits long for its point. Private to
/// this folder.
#pragma once

#include <optional>

#include "server/collision/closest_search.h"
#include "server/collision/expanding_polytope.h"

namespace cradle {

inline constexpr double kSure_m = 1e-11;  ///< overlaps this near to each other are one
inline constexpr double kDeepOverlap =
    0.01;  ///< of the thickness: so deep, no distance is asked for

bool has_corners(const ConvexShape& shape);  ///< its core has, and nothing else

/// Some unit vector across n.
Vector unit_across(const Vector& n);

/// Where the sides of a first tetrahedron about n point to.
std::array<Vector, 3> around(const Vector& n);

/// A tetrahedron from well inside M, which becomes the first of the `corners`, with a wide side
/// across n between the others, which are farthest `around(n)`; and what is farthest along n
/// itself, the `top`.
bool begin_below(const ConvexPair& pair, std::array<Difference, 4>& corners, const Difference& top,
                 ExpandingPolytope& polytope);

/// Some tetrahedron in M, as wide as may be.
bool begin_anywhere(const ConvexPair& pair, SupportHints& hints, ExpandingPolytope& polytope);

/// A polytope in M grows until its nearest face lies in M's surface; and on, until it is known by
/// how much all other directions overlap more.
class ExpandingSearch {
 public:
  ExpandingPolytope polytope;  ///< has begun before `begin`

  /// Gives up where an overlap is below `least`, m.
  void begin(double least, double lead_wanted);

  bool is_done() const { return stage_ >= Stage::found; }
  bool has_found() const { return stage_ == Stage::found; }  ///< else rounding got in the way
  const Vector& direction() const { return polytope.face(face_).n; }
  bool take(const Difference& next);  ///< whether its direction is the best so far
  const LeastOverlap& best() const { return best_; }
  /// Of the one that it looked at last.
  std::array<Difference, 3> corners_of_face() const { return polytope.corners_of(face_); }

 private:
  enum class Stage { growing, leading, found, failed };

  void aim();
  void lead_by(const Difference& next, bool is_in_surface);
  void look_for_lead();
  void aim_at_others();
  void end(double lead);

  Stage stage_ = Stage::growing;
  double least_ = 0, lead_wanted_ = 0;
  LeastOverlap best_;
  int face_ = -1, best_face_ = -1, lead_steps_ = 0;
  bool is_other_ = false;  ///< the face looks elsewhere than the best direction
};

/// Two cores from the start: their distance, or their overlap where they are not apart.
class PolytopeSearch {
 public:
  /// As for `least_overlap`. All must last. It begins with the corners of these names, or along
  /// `toward`, a unit vector, if there are none.
  PolytopeSearch(const ConvexPair& pair, double limit, double lead_wanted, SupportHints& hints,
                 const Vector& toward, std::uint32_t names = 0);

  bool is_done() const { return stage_ == Stage::done; }
  const Vector& direction() const { return *direction_; }  ///< of the support point it waits for
  void take(const Difference& next);                       ///< that point
  const LeastOverlap& best() const { return best_; }       ///< once it is done

 private:
  enum class Stage { first, across, distance, apart, expanding, done };

  void take_first(const Difference& next);
  void take_across(const Difference& next);
  void seek_distance();
  void seek_distance_from_face();
  void judge_distance();
  void expand(double least);
  void judge_expanding();
  void fall_back();
  void end(const LeastOverlap& best);

  const ConvexPair& pair_;
  const double limit_, lead_wanted_;
  SupportHints& hints_;
  SupportHints farthest_;  ///< along the best direction
  Stage stage_ = Stage::first;
  Vector n_;                           ///< where it begins
  const Vector* direction_ = nullptr;  ///< not copied: to read what was just written takes time
  Simplex simplex_;
  std::array<Difference, 4> corners_;
  std::array<Vector, 3> across_;
  std::size_t corner_count_ = 0;
  std::optional<ClosestSearch> distance_;
  ExpandingSearch expanding_;
  LeastOverlap best_;
};

}  // namespace cradle
