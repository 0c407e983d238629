/// Random numbers, directions and attitudes: the same for a seed with every standard library.
#pragma once

#include <cstdint>
#include <random>

#include "server/collision/geometry.h"

namespace cradle {

class RandomPoses {
 public:
  explicit RandomPoses(std::uint64_t seed) : engine_(seed) {}

  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  Vector vector(double size) {
    return {uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  }
  Vector direction() {
    Vector d;
    do d = vector(1);
    while (d.norm() > 1 || d.norm() < 0.1);
    return d.normalized();
  }
  Matrix rotation() {
    Rotation q;
    do q = Rotation{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
    while (q.norm() > 1 || q.norm() < 0.1);
    return q.normalized().toRotationMatrix();
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace cradle
