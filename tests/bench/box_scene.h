/// Seeded scenes of boxes for the broad phase, and their pairs by brute force.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "server/collision/broad_phase.h"

namespace cradle::bench {

struct BoxScene {
  explicit BoxScene(std::uint64_t seed) : random(seed) {}

  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  }
  Vector vector(double size) {
    return {uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  }
  std::size_t any_slot() { return random() % boxes.size(); }

  void add(const Vector& middle, const Vector& half, bool moves_ = true) {
    boxes.push_back({middle - half, middle + half});
    moves.push_back(moves_ ? 1 : 0);
    velocities.push_back(Vector::Zero());
  }
  void move(std::size_t slot, const Vector& by) {
    boxes[slot].lower += by;
    boxes[slot].upper += by;
  }
  BroadPhaseInput input(bool renumbered = false) const {
    return {boxes, moves, planes, renumbered};
  }

  std::vector<BodyPair> brute_force() const {
    std::vector<BodyPair> pairs;
    for (std::size_t a = 0; a < boxes.size(); ++a) {
      for (std::size_t b = a + 1; b < boxes.size(); ++b) {
        if ((moves[a] != 0 || moves[b] != 0) && boxes[a].overlaps(boxes[b])) {
          pairs.push_back({static_cast<std::int32_t>(a), static_cast<std::int32_t>(b)});
        }
      }
    }
    return pairs;
  }

  std::mt19937_64 random;
  std::vector<Aabb> boxes;
  std::vector<std::uint8_t> moves;
  std::vector<Vector> velocities;  // a step
  std::vector<Plane> planes;
};

/// The scene of the benchmark: sides of 0.6 to 1.4, 0.25 a cubic metre, up to 0.02 m a step.
inline BoxScene drifting_boxes(std::size_t count, std::uint64_t seed = 1) {
  BoxScene scene(seed);
  const double half_room = 0.5 * std::cbrt(static_cast<double>(count) / 0.25);
  for (std::size_t i = 0; i < count; ++i) {
    const Vector middle = scene.vector(half_room);
    scene.add(middle, Vector::Constant(scene.uniform(0.3, 0.7)));
    scene.velocities.back() = scene.vector(0.02);
  }
  return scene;
}

/// A step of the first `moving` boxes; they turn back at the walls of the room.
inline void drift(BoxScene& scene, std::size_t moving) {
  const double half_room = 0.5 * std::cbrt(static_cast<double>(scene.boxes.size()) / 0.25);
  for (std::size_t i = 0; i < moving; ++i) {
    const Vector middle = 0.5 * (scene.boxes[i].lower + scene.boxes[i].upper);
    Vector& v = scene.velocities[i];
    for (int k = 0; k < 3; ++k) {
      if (std::abs(middle[k]) > half_room) v[k] = std::copysign(v[k], -middle[k]);
    }
    scene.move(i, v);
  }
}

}  // namespace cradle::bench
