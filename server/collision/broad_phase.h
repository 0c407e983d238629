/// Finds the pairs of bodies whose boxes overlap: the coarse culling before the narrow phase.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/collision/executor.h"
#include "server/collision/geometry.h"

namespace cradle {

/// Two slots, a < b.
struct BodyPair {
  std::int32_t a = 0, b = 0;
  friend auto operator<=>(const BodyPair&, const BodyPair&) = default;
};

/// The boundary of an infinite body: solid where normal . x <= offset.
struct Plane {
  std::int32_t slot = 0;
  Vector normal_W = Vector::UnitZ();  ///< unit, out of the solid
  double offset = 0;                  ///< m
};

/// Boxes that are empty, not finite or reach beyond 1e100 m meet nothing.
struct BroadPhaseInput {
  std::span<const Aabb> boxes;          ///< one a slot
  std::span<const std::uint8_t> moves;  ///< one a slot; two slots with 0 are no pair, planes too
  std::span<const Plane> planes;        ///< their slots have empty boxes
  bool renumbered = false;              ///< true if slots do not mean the bodies of last time
  /// Which body has which slot, ascending; looked at when `renumbered`. None: it is not known.
  std::span<const std::int64_t> ids = {};
  Executor* executor = &serial_executor;  ///< where work goes that may be done side by side
};

/// What a call came to.
struct BroadPhaseReport {
  std::string_view method;      ///< how all pairs were last found anew, in a word
  std::int64_t crowded = 0;     ///< bodies in more pairs than are kept; see pairs_max
  std::int64_t boxes_seen = 0;  ///< work done: boxes looked at, alone or in pairs
  std::int64_t nodes_seen = 0;  ///< work done: nodes of trees or cells of grids
};

class BroadPhase {
 public:
  virtual ~BroadPhase() = default;

  /// Replaces `pairs` by all overlapping pairs, sorted by (a, b), each once. Touching counts.
  /// Pairs and their order, and `crowded`, depend on the input alone, never on earlier calls.
  ///
  /// If there are more than pairs_max of them, each slot keeps those with its partners_kept
  /// smallest partners, and a pair stays if either of the two keeps it: a floor under many bodies
  /// loses none, a thousand bodies in one point lose most.
  virtual BroadPhaseReport find_pairs(const BroadPhaseInput& input,
                                      std::vector<BodyPair>& pairs) = 0;
};

/// How many pairs a call gives at most: beyond, they would not fit the memory, nor the tick.
constexpr std::size_t pairs_max(std::size_t slots) {
  return std::min(128 * slots, 4'000'000 + 8 * slots);
}

/// Of each body, where there are more: what fits with room to spare, since crowds are slow to part.
constexpr std::size_t partners_kept(std::size_t slots) { return pairs_max(slots) / (4 * slots); }

/// Ours: trees over boxes with room to move, and the pairs of these kept from call to call.
/// O(n log n) for bounded density; what does not move costs next to nothing.
std::unique_ptr<BroadPhase> make_kept_broad_phase();

/// FCL's dynamic AABB tree, rebuilt now and then because it decays. O(n log n) for bounded density.
std::unique_ptr<BroadPhase> make_fcl_broad_phase();

/// The default first.
std::vector<std::string> broad_phase_names();
/// Null if there is none of that name.
std::unique_ptr<BroadPhase> make_broad_phase(std::string_view name);

}  // namespace cradle
