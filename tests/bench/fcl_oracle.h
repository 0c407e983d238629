/// FCL's answers about pairs of shapes, from child processes: Debian's build keeps its asserts, and
/// an oracle must not end the program that asks.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "tests/bench/solids.h"

namespace cradle::bench {

/// What is asked of FCL. Always its solver LIBCCD, since the other one gives wrong normals.
enum class FclQuestion {
  contacts,         ///< collide with up to eight contacts
  distance,         ///< unsigned
  signed_distance,  ///< EPA where they overlap
};

struct FclAnswer {
  enum class End { answered, threw, died } end = End::died;
  int points = 0;               ///< contacts; of a distance 1
  double separation = 0;        ///< m, of the deepest point; of a distance -1 if overlapping
  Vector n = Vector::Zero();    ///< from A to B
  Vector p_W = Vector::Zero();  ///< of the deepest contact
};

/// Whether FCL may be asked at all: it has such shapes, and no half-space in a distance, which
/// crashes it.
bool can_ask_fcl(const Pair& pair, FclQuestion question);

/// One answer each. A pair on which the child dies is marked so, and the next child goes on.
std::vector<FclAnswer> ask_fcl(std::span<const Pair> pairs, FclQuestion question);

/// How FCL looks for the time of an impact.
enum class FclSearch {
  samples,     ///< its default: ten poses on the way
  advancement  ///< conservative advancement
};

/// What FCL says of B, which moves from its pose to beyond A by `travel` (m, in W) in the time 0
/// to 1.
struct FclImpact {
  FclAnswer::End end = FclAnswer::End::died;
  bool is_hit = false;
  double time = 1;
};

/// One answer each, as above. With `as_mesh`, A is the mesh of its hull's faces.
std::vector<FclImpact> ask_fcl_impacts(std::span<const Pair> pairs, const Vector& travel,
                                       FclSearch search, bool as_mesh = false);

/// ns a pair, the median of several rounds over all of them; none if a child died of it.
std::optional<double> time_fcl(std::span<const Pair> pairs, FclQuestion question);

}  // namespace cradle::bench
