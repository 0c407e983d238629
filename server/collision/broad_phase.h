/// Finds the pairs of bodies whose boxes overlap: the coarse culling before the narrow phase.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

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
};

class BroadPhase {
 public:
  virtual ~BroadPhase() = default;

  /// Replaces `pairs` by all overlapping pairs, sorted by (a, b), each once. Touching counts.
  /// The result depends on the input alone, never on earlier calls.
  virtual void find_pairs(const BroadPhaseInput& input, std::vector<BodyPair>& pairs) = 0;
};

/// FCL's dynamic AABB tree, rebuilt now and then because it decays. O(n log n) for bounded density.
std::unique_ptr<BroadPhase> make_fcl_broad_phase();

}  // namespace cradle
