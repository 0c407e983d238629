/// Boxes in single precision, four abreast, for culling.
///
/// A coordinate is taken from an origin near by, and rounded to the nearest float. Neither turns
/// order around, so boxes that overlap still do then; some that do not, do, too.
///
/// With SSE2, which every x86-64 has, or without: the same bits.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "server/collision/geometry.h"

namespace cradle {

inline constexpr double kFloatReach = 3e38;  ///< beyond it coordinates are cut off
inline constexpr std::size_t kFloatLanes = 4;

/// The fourth numbers are 0.
struct FloatBox {
  alignas(16) std::array<float, 4> lower{};
  alignas(16) std::array<float, 4> upper{};
};

static_assert(sizeof(Aabb) == 6 * sizeof(double));  // lower, then upper

#if defined(__SSE2__)

inline FloatBox to_float(const Aabb& box, const Vector& origin) {
  const auto part = [](const double* from, __m128d o) {
    const __m128d x = _mm_sub_pd(_mm_loadu_pd(from), o);
    return _mm_cvtpd_ps(
        _mm_min_pd(_mm_max_pd(x, _mm_set1_pd(-kFloatReach)), _mm_set1_pd(kFloatReach)));
  };
  const double* const x = box.lower.data();
  const __m128 xy = part(x, _mm_loadu_pd(origin.data()));
  const __m128 zx = part(x + 2, _mm_set_pd(origin[0], origin[2]));
  const __m128 yz = part(x + 4, _mm_loadu_pd(origin.data() + 1));  // all with zeros behind
  FloatBox result;
  _mm_store_ps(result.lower.data(), _mm_shuffle_ps(xy, zx, _MM_SHUFFLE(2, 0, 1, 0)));
  const __m128 upper_xy = _mm_shuffle_ps(zx, yz, _MM_SHUFFLE(1, 0, 1, 1));  // x x y z
  _mm_store_ps(result.upper.data(),
               _mm_and_ps(_mm_shuffle_ps(upper_xy, upper_xy, _MM_SHUFFLE(3, 3, 2, 1)),
                          _mm_castsi128_ps(_mm_set_epi32(0, -1, -1, -1))));
  return result;
}

inline bool contains(const FloatBox& outer, const FloatBox& inner) {
  const __m128 below =
      _mm_cmple_ps(_mm_load_ps(outer.lower.data()), _mm_load_ps(inner.lower.data()));
  const __m128 above =
      _mm_cmple_ps(_mm_load_ps(inner.upper.data()), _mm_load_ps(outer.upper.data()));
  return _mm_movemask_ps(_mm_and_ps(below, above)) == 15;
}

/// For boxes that are not empty.
inline bool overlap(const Aabb& a, const Aabb& b) {
  const double *const al = a.lower.data(), *const au = a.upper.data();
  const double *const bl = b.lower.data(), *const bu = b.upper.data();
  const __m128d z = _mm_cmple_pd(_mm_set_pd(al[2], bl[2]), _mm_set_pd(bu[2], au[2]));
  const __m128d one = _mm_cmple_pd(_mm_loadu_pd(al), _mm_loadu_pd(bu));
  const __m128d other = _mm_cmple_pd(_mm_loadu_pd(bl), _mm_loadu_pd(au));
  return _mm_movemask_pd(_mm_and_pd(z, _mm_and_pd(one, other))) == 3;
}

/// Bit by bit: a NaN is the same as itself.
inline bool same(const Aabb& a, const Aabb& b) {
  static_assert(sizeof(Aabb) == 3 * sizeof(__m128i));
  const auto* const p = reinterpret_cast<const __m128i*>(&a);
  const auto* const q = reinterpret_cast<const __m128i*>(&b);
  const auto differ = [&](int k) {
    return _mm_xor_si128(_mm_loadu_si128(p + k), _mm_loadu_si128(q + k));
  };
  const __m128i all = _mm_or_si128(differ(0), _mm_or_si128(differ(1), differ(2)));
  return _mm_movemask_epi8(_mm_cmpeq_epi8(all, _mm_setzero_si128())) == 0xffff;
}

#else

inline FloatBox to_float(const Aabb& box, const Vector& origin) {
  const auto round = [](double x) {
    return static_cast<float>(std::min(std::max(x, -kFloatReach), kFloatReach));
  };
  FloatBox result;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    result.lower[k] = round(box.lower[i] - origin[i]);
    result.upper[k] = round(box.upper[i] - origin[i]);
  }
  return result;
}

inline bool contains(const FloatBox& outer, const FloatBox& inner) {
  bool inside = true;
  for (std::size_t k = 0; k < 3; ++k) {
    inside &= outer.lower[k] <= inner.lower[k];
    inside &= inner.upper[k] <= outer.upper[k];
  }
  return inside;
}

/// For boxes that are not empty.
inline bool overlap(const Aabb& a, const Aabb& b) { return a.overlaps(b); }

/// Bit by bit: a NaN is the same as itself.
inline bool same(const Aabb& a, const Aabb& b) {
  static_assert(sizeof(Aabb) == 6 * sizeof(double));
  return std::memcmp(&a, &b, sizeof(Aabb)) == 0;
}

#endif

inline FloatBox hull(const FloatBox& a, const FloatBox& b) {
  FloatBox result;
  for (std::size_t k = 0; k < 4; ++k) {
    result.lower[k] = std::min(a.lower[k], b.lower[k]);
    result.upper[k] = std::max(a.upper[k], b.upper[k]);
  }
  return result;
}

/// Four boxes, one a lane. Lanes nobody has set meet nothing.
struct BoxLanes {
  alignas(16) float lower[3][kFloatLanes];
  alignas(16) float upper[3][kFloatLanes];

  BoxLanes() {
    for (std::size_t lane = 0; lane < kFloatLanes; ++lane) clear(lane);
  }
  void clear(std::size_t lane) {
    for (std::size_t k = 0; k < 3; ++k) {
      lower[k][lane] = HUGE_VALF;
      upper[k][lane] = -HUGE_VALF;
    }
  }
  void set(std::size_t lane, const FloatBox& box) {
    for (std::size_t k = 0; k < 3; ++k) {
      lower[k][lane] = box.lower[k];
      upper[k][lane] = box.upper[k];
    }
  }
  FloatBox get(std::size_t lane) const {
    FloatBox box;
    for (std::size_t k = 0; k < 3; ++k) {
      box.lower[k] = lower[k][lane];
      box.upper[k] = upper[k][lane];
    }
    return box;
  }
  FloatBox bounds() const { return hull(hull(get(0), get(1)), hull(get(2), get(3))); }
};

using FourFloats = float __attribute__((vector_size(16)));

/// Bit i: lane i is negative.
inline unsigned signs_of(const FourFloats& lanes) {
#if defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_ps(__m128(lanes)));
#else
  unsigned bits = 0;
  for (int lane = 0; lane < 4; ++lane) bits |= lanes[lane] < 0 ? 1U << lane : 0U;
  return bits;
#endif
}

/// Writes `first` plus the number of each lane that is hit, ascending, and anything behind; there
/// is room for all four. Returns how many are.
inline std::size_t put_lanes(unsigned hits, std::uint32_t first, std::uint32_t* to) {
  using Four = std::uint32_t __attribute__((vector_size(16)));
  struct Lanes {
    std::array<std::uint32_t, kFloatLanes> numbers{};
    std::size_t count = 0;
  };
  static constexpr std::array kLanesHit = [] {
    std::array<Lanes, 1U << kFloatLanes> all{};
    for (unsigned bits = 0; bits < all.size(); ++bits) {
      for (std::uint32_t lane = 0; lane < kFloatLanes; ++lane) {
        if ((bits >> lane & 1U) != 0) all[bits].numbers[all[bits].count++] = lane;
      }
    }
    return all;
  }();
  Four numbers;
  std::memcpy(&numbers, &kLanesHit[hits].numbers, sizeof numbers);
  numbers += first;
  std::memcpy(to, &numbers, sizeof numbers);
  return kLanesHit[hits].count;
}

/// One box in all lanes, to compare with four others at once.
class Probe {
 public:
  explicit Probe(const FloatBox& box)
      : Probe(box.lower[0], box.lower[1], box.lower[2], box.upper[0], box.upper[1], box.upper[2]) {}

  /// Bit i: the box overlaps that of lane i.
  unsigned overlaps(const BoxLanes& lanes) const {
    return overlaps(lanes.lower[0], lanes.upper[0], kFloatLanes);
  }

#if defined(__SSE2__)
  Probe(float lx, float ly, float lz, float ux, float uy, float uz)
      : lower_{_mm_set1_ps(lx), _mm_set1_ps(ly), _mm_set1_ps(lz)},
        upper_{_mm_set1_ps(ux), _mm_set1_ps(uy), _mm_set1_ps(uz)} {}

  /// Of four boxes the lower x from `lower` on, y `stride` further, then z; likewise the upper.
  unsigned overlaps(const float* lower, const float* upper, std::size_t stride) const {
    const auto along = [&](std::size_t k) {
      return _mm_and_ps(_mm_cmple_ps(_mm_loadu_ps(lower + k * stride), upper_[k]),
                        _mm_cmple_ps(lower_[k], _mm_loadu_ps(upper + k * stride)));
    };
    const __m128 all = _mm_and_ps(along(0), _mm_and_ps(along(1), along(2)));
    return static_cast<unsigned>(_mm_movemask_ps(all));
  }

 private:
  __m128 lower_[3], upper_[3];
#else
  Probe(float lx, float ly, float lz, float ux, float uy, float uz)
      : lower_{lx, ly, lz}, upper_{ux, uy, uz} {}

  unsigned overlaps(const float* lower, const float* upper, std::size_t stride) const {
    unsigned bits = 0;
    for (std::size_t lane = 0; lane < kFloatLanes; ++lane) {
      bool all = true;
      for (std::size_t k = 0; k < 3; ++k) {
        all &= lower[k * stride + lane] <= upper_[k];
        all &= lower_[k] <= upper[k * stride + lane];
      }
      bits |= all ? 1U << lane : 0U;
    }
    return bits;
  }

 private:
  float lower_[3], upper_[3];
#endif
};

}  // namespace cradle
