/// FCL's answers about pairs of shapes, from child processes: Debian's build keeps its asserts, and
/// an oracle must not end the program that asks.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "tests/bench/solids.h"

namespace cradle::bench {

/// What is asked of FCL.
enum class FclQuestion {
  contacts,         ///< collide with up to eight contacts
  distance,         ///< unsigned
  signed_distance,  ///< EPA where they overlap
};

/// How it is asked, where that is not by default.
struct FclWay {
  bool by_other_solver = false;  ///< GST_INDEP; else GST_LIBCCD, whose normals are right
  double tolerance = 1e-6;       ///< m, of either solver
};

/// How a question ended.
struct FclEnd {
  enum class End { answered, threw, died } end = End::died;
  int signal = 0;  ///< of which the child died
};

struct FclAnswer : FclEnd {
  int points = 0;               ///< contacts; of a distance 1
  double separation = 0;        ///< m, of the deepest point; of a distance -1 if overlapping
  Vector n = Vector::Zero();    ///< from A to B, which may not be as FCL gave it:
  bool is_exchanged = false;    ///< the contact names B as the first body, and has the normal so
  Vector p_W = Vector::Zero();  ///< of the deepest contact
};

/// Whether FCL has an answer: it has such shapes, and no half-space in a distance, which crashes
/// it.
bool can_ask_fcl(const Pair& pair, FclQuestion question);

/// One answer each, also of triangle meshes. A pair on which the child dies is marked so, and the
/// next child goes on.
std::vector<FclAnswer> ask_fcl(std::span<const Pair> pairs, FclQuestion question, FclWay way = {});

/// The box that FCL's broad phase keeps of each A.
std::vector<Aabb> ask_fcl_boxes(std::span<const Pair> pairs);

/// How FCL looks for the time of an impact.
enum class FclSearch {
  samples,     ///< its default: ten poses on the way
  advancement  ///< conservative advancement
};

/// How FCL moves a body from one pose to another.
enum class FclMotion { translation, screw };

/// What FCL says of B, which moves from its pose to beyond A by `travel` (m, in W) in the time 0
/// to 1.
struct FclImpact : FclEnd {
  bool is_hit = false;
  double time = 1;
};

/// One answer each, as above.
std::vector<FclImpact> ask_fcl_impacts(std::span<const Pair> pairs, const Vector& travel,
                                       FclSearch search, FclMotion motion = FclMotion::translation);

/// ns a pair, the median of several rounds over all of them; none if a child died of it.
std::optional<double> time_fcl(std::span<const Pair> pairs, FclQuestion question);

}  // namespace cradle::bench
