// Which boxes of a grid overlap one, for the kernels' files alone (see lanes.h): as many floats at
// once as a vector has room for. A comparison is one at every width.
#pragma once

#include "server/collision/box_block.h"
#include "server/collision/lanes.h"

namespace cradle {
namespace {

/// As many floats as `V` has room for, but four at least.
template <class V>
struct FloatsOf {
  typedef float Type __attribute__((vector_size(sizeof(V) < 16 ? 16 : sizeof(V))));
};

template <class F>
CRADLE_LANES F load_floats(const float* from) {
  F floats;
  __builtin_memcpy(&floats, from, sizeof floats);
  return floats;
}

/// The numbers of the lanes with a bit, of four.
struct LanesHit {
  std::uint32_t numbers[16][4] = {}, count[16] = {};
  constexpr LanesHit() {
    for (std::uint32_t bits = 0; bits < 16; ++bits) {
      for (std::uint32_t l = 0; l < 4; ++l) {
        if ((bits >> l & 1U) != 0) numbers[bits][count[bits]++] = l;
      }
    }
  }
};
constexpr LanesHit kLanesHit;

/// Writes `first` plus the number of each of so many lanes that has a bit, ascending, and anything
/// behind. Which ones these are is chance, so: no branches.
template <std::uint32_t lanes>
CRADLE_LANES std::uint32_t* put_hits(std::uint32_t hits, std::uint32_t first, std::uint32_t* to) {
#ifdef __AVX512F__
  if constexpr (lanes == 16) {
    const __m512i numbers = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    const auto bits = static_cast<__mmask16>(hits);
    const __m512i from_first =
        _mm512_maskz_add_epi32(0xffff, numbers, _mm512_set1_epi32(static_cast<int>(first)));
    _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(bits, from_first));
    return to + __builtin_popcount(hits);
  }
#endif
  for (std::uint32_t part = 0; part < lanes; part += 4) {
    using Four = std::uint32_t __attribute__((vector_size(16)));
    const std::uint32_t bits = hits >> part & 15U;
    Four numbers;
    __builtin_memcpy(&numbers, kLanesHit.numbers[bits], sizeof numbers);
    numbers += first + part;
    __builtin_memcpy(to, &numbers, sizeof numbers);
    to += kLanesHit.count[bits];
  }
  return to;
}

template <class F>
std::size_t find_overlaps(const GridBoxes& of_grid, std::uint32_t box, const GridRange* ranges,
                          std::size_t count, std::uint32_t* __restrict found) {
  constexpr std::uint32_t lanes = sizeof(F) / sizeof(float);
  const GridBoxes boxes = of_grid;  // nothing that is written could be part of it
  const auto column = [&](std::size_t k) { return boxes.bounds + k * boxes.stride; };
  F lower[3], upper[3];
  CRADLE_UNROLLED
  for (std::size_t k = 0; k < 3; ++k) {
    lower[k] = F{} + column(k)[box];
    upper[k] = F{} + column(3 + k)[box];
  }
  std::uint32_t* to = found;
  for (std::size_t r = 0; r < count; ++r) {
    const std::uint32_t end = ranges[r].end;
    std::uint32_t at = ranges[r].begin;
    do {  // most ranges have some boxes, and few more than there are lanes
      const auto along = [&](std::size_t k) CRADLE_LAMBDA {
        return (load_floats<F>(column(k) + at) <= upper[k]) &
               (lower[k] <= load_floats<F>(column(3 + k) + at));
      };
      const std::uint32_t hits = signs_of(F(along(0) & along(1) & along(2)));
      const std::uint32_t left = end - at, within = (1U << (left < lanes ? left : lanes)) - 1;
      to = put_hits<lanes>(hits & within, at, to);
      at += lanes;
    } while (at < end);
  }
  return static_cast<std::size_t>(to - found);
}

}  // namespace
}  // namespace cradle
