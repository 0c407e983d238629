/// Trees over boxes of bodies, those that move and those that do not apart. Private to this folder.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/box_tree.h"

namespace cradle {

/// Trees over the rooms of bodies that move, and over those of bodies that do not.
struct Layer {
  std::vector<std::int32_t> moving_slots, immovable_slots;
  BoxTree moving, immovable;

  void add(std::int32_t slot, bool moves) {
    (moves ? moving_slots : immovable_slots).push_back(slot);
  }
  void clear() {
    moving_slots.clear();
    immovable_slots.clear();
  }
  template <class F>
  void keep(F&& stays) {
    const auto leaves = [&](std::int32_t slot) { return !stays(slot); };
    std::erase_if(moving_slots, leaves);
    std::erase_if(immovable_slots, leaves);
  }
  void renumber(std::span<const std::int32_t> now) {
    for (auto* slots : {&moving_slots, &immovable_slots}) {
      for (std::int32_t& slot : *slots) slot = now[static_cast<std::size_t>(slot)];
      std::erase_if(*slots, [](std::int32_t slot) { return slot < 0; });
    }
  }
  void build(std::span<const FloatBox> rooms, const MortonCurve& curve) {
    moving.build(rooms, moving_slots, curve);
    immovable.build(rooms, immovable_slots, curve);
  }
  /// For the same slots as the last time.
  void refit(std::span<const FloatBox> rooms) {
    moving.refit(rooms);
    immovable.refit(rooms);
  }
  std::size_t size() const { return moving_slots.size() + immovable_slots.size(); }
};

}  // namespace cradle
