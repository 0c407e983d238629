/// Many alike bodies on a grid: the [[lattice]] of a scene file.
///
/// The same lattice gives the same bits on every machine: the only random numbers are those of
/// std::mt19937_64, which the standard fixes, and no function of libm but sqrt is used.
#pragma once

#include <cradle/types.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace cradle {

/// Documented key by key in tests/scenes/README.md.
struct Lattice {
  std::array<std::int64_t, 3> count{};  ///< in x, y, z; each 1 or more
  Vec3 pitch_m;
  Vec3 origin_m;                        ///< W, of the first body's lattice point
  std::array<std::int64_t, 2> taper{};  ///< fewer in x and y with each layer up; leaves 1 or more
  std::int64_t seed = 1;
  std::optional<Vec3> jitter_m;
  bool random_orientation = false;
  std::optional<Vec3> velocity_jitter_mps;
  std::optional<Vec3> angular_velocity_jitter_radps;
  std::vector<BodySpec> bodies;  ///< taken in turn; p_WBo is relative to the lattice point
};

/// Layer by layer, in each row by row, x fastest.
///
/// Random numbers are drawn body by body, for each: three of jitter_m (x, y, z), then fours for the
/// orientation (w, x, y, z) until one lies in the unit ball, then three of velocity_jitter_mps,
/// then three of angular_velocity_jitter_radps; none for what is absent.
std::vector<BodySpec> bodies_of(const Lattice& lattice);

}  // namespace cradle
