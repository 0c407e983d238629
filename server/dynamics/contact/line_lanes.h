// Lines of eight doubles to lanes and back, for the kernels' files alone (see lanes.h). Lanes of
// floats round on the way.
//
// Floats move by fours: four numbers of the lines l, l + 4, l + 8... side by side in a vector,
// whose groups of four are then transposed by themselves. What crosses groups is slow on many
// machines (eight steps instead of one on AMD Zen 1).
#pragma once

#include "server/collision/lanes.h"
#include "server/dynamics/contact/contact_block.h"

namespace cradle {
namespace {

using TwoDoubles = double __attribute__((vector_size(16)));
using TwoFloats = float __attribute__((vector_size(8)));
using FourFloats = float __attribute__((vector_size(16)));

/// Half as many floats.
template <class V>
struct HalfOfFloats {
  typedef float Type __attribute__((vector_size(sizeof(V) / 2)));
};
template <class V, class Half, std::size_t... l>
CRADLE_LANES V shuffled_together(const Half& lower, const Half& upper, std::index_sequence<l...>) {
  return __builtin_shufflevector(lower, upper, int(l)...);
}
template <class V, class Half>
CRADLE_LANES V joined(const Half& lower, const Half& upper) {
#ifdef __AVX__  // not what the compiler makes of the shuffle
  if constexpr (sizeof(V) == 32) {
    return V(_mm256_insertf128_ps(_mm256_castps128_ps256(__m128(lower)), __m128(upper), 1));
  }
#endif
#ifdef __AVX512F__
  if constexpr (sizeof(V) == 64) {
    return V(
        _mm512_maskz_insertf32x8(0xffff, _mm512_castps256_ps512(__m256(lower)), __m256(upper), 1));
  }
#endif
  return shuffled_together<V>(lower, upper, std::make_index_sequence<kLanes<V>>{});
}
/// The k-th four of them.
template <int k, class V>
CRADLE_LANES FourFloats four_of(const V& v) {
  static_assert(4 * k < kLanes<V>);
#ifdef __AVX__  // likewise
  if constexpr (sizeof(V) == 32) {
    return FourFloats(k == 0 ? _mm256_castps256_ps128(__m256(v))
                             : _mm256_extractf128_ps(__m256(v), k));
  }
#endif
  return __builtin_shufflevector(v, v, 4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3);
}

CRADLE_LANES FourFloats load_four(const double* from) {
#ifdef __AVX__
  return FourFloats(_mm256_cvtpd_ps(_mm256_loadu_pd(from)));
#else
  return joined<FourFloats>(__builtin_convertvector(load<TwoDoubles>(from), TwoFloats),
                            __builtin_convertvector(load<TwoDoubles>(from + 2), TwoFloats));
#endif
}
CRADLE_LANES void store_four(double* to, const FourFloats& v) {
#ifdef __AVX__
  _mm256_storeu_pd(to, _mm256_cvtps_pd(__m128(v)));
#else
  store(to, __builtin_convertvector(__builtin_shufflevector(v, v, 0, 1), TwoDoubles));
  store(to + 2, __builtin_convertvector(__builtin_shufflevector(v, v, 2, 3), TwoDoubles));
#endif
}
/// Adds to four numbers, in double precision.
CRADLE_LANES void change_four(double* numbers, const FourFloats& by) {
#ifdef __AVX__
  _mm256_storeu_pd(numbers, _mm256_add_pd(_mm256_loadu_pd(numbers), _mm256_cvtps_pd(__m128(by))));
#else
  store(numbers, load<TwoDoubles>(numbers) +
                     __builtin_convertvector(__builtin_shufflevector(by, by, 0, 1), TwoDoubles));
  store(numbers + 2,
        load<TwoDoubles>(numbers + 2) +
            __builtin_convertvector(__builtin_shufflevector(by, by, 2, 3), TwoDoubles));
#endif
}

/// Of each group of four lanes, elements `first` and the second after or the next one of both, as
/// `step` says: one instruction.
template <int first, int step, class V, std::size_t... l>
CRADLE_LANES V two_of_each(const V& a, const V& b, std::index_sequence<l...>) {
  constexpr int n = kLanes<V>;
  return __builtin_shufflevector(
      a, b, (int(l) / 4 * 4 + first + int(l) % 2 * step + (int(l) % 4 < 2 ? 0 : n))...);
}
/// In each group of four lanes of four rows, element l of row k becomes element k of row l.
template <class V>
CRADLE_LANES void transpose_fours(V* rows) {
  constexpr auto lanes = std::make_index_sequence<kLanes<V>>{};
  const V a = two_of_each<0, 1>(rows[0], rows[1], lanes);
  const V b = two_of_each<2, 1>(rows[0], rows[1], lanes);
  const V c = two_of_each<0, 1>(rows[2], rows[3], lanes);
  const V d = two_of_each<2, 1>(rows[2], rows[3], lanes);
  rows[0] = two_of_each<0, 2>(a, c, lanes);
  rows[1] = two_of_each<1, 2>(a, c, lanes);
  rows[2] = two_of_each<0, 2>(b, d, lanes);
  rows[3] = two_of_each<1, 2>(b, d, lanes);
}

/// Four numbers of the lines l, l + 4...
template <class V, class From>
CRADLE_LANES V fours(int l, const From& from) {
  if constexpr (kLanes<V> == 4) {
    return load_four(from(l));
  } else {
    using Half = typename HalfOfFloats<V>::Type;
    return joined<V>(fours<Half>(l, from), fours<Half>(l + kLanes<Half>, from));
  }
}
/// Four numbers of each lane's line, from `from(l)` on: the k-th into rows[k].
template <class V, class From>
CRADLE_LANES void load_four_rows(V* rows, const From& from) {
  CRADLE_UNROLLED
  for (int l = 0; l < 4; ++l) rows[l] = fours<V>(l, from);
  transpose_fours(rows);
}
/// Back: calls `put(l, four)` with four numbers of each lane's line.
template <class V, class Put>
CRADLE_LANES void put_four_rows(V* rows, const Put& put) {
  constexpr int n = kLanes<V>;
  transpose_fours(rows);
  CRADLE_UNROLLED
  for (int l = 0; l < 4; ++l) {
    put(l, four_of<0>(rows[l]));
    if constexpr (n > 4) put(l + 4, four_of<1>(rows[l]));
    if constexpr (n > 8) put(l + 8, four_of<2>(rows[l]));
    if constexpr (n > 8) put(l + 12, four_of<3>(rows[l]));
  }
}

// Of sixteen lanes, whole lines of eight.

template <class Eight>
CRADLE_LANES Eight load_eight(const double* from) {
#ifdef __AVX512F__
  return Eight(_mm512_maskz_cvtpd_ps(0xff, _mm512_loadu_pd(from)));
#else
  return joined<Eight>(load_four(from), load_four(from + 4));
#endif
}
/// Likewise, to eight.
template <class Eight>
CRADLE_LANES void change_eight(double* numbers, const Eight& by) {
#ifdef __AVX512F__
  _mm512_storeu_pd(numbers, _mm512_loadu_pd(numbers) + _mm512_maskz_cvtps_pd(0xff, __m256(by)));
#else
  change_four(numbers, four_of<0>(by));
  change_four(numbers + 4, four_of<1>(by));
#endif
}
template <class V, class Eight = typename HalfOfFloats<V>::Type>
CRADLE_LANES Eight lower_eight(const V& v) {
  return __builtin_shufflevector(v, v, 0, 1, 2, 3, 4, 5, 6, 7);
}
template <class V, class Eight = typename HalfOfFloats<V>::Type>
CRADLE_LANES Eight upper_eight(const V& v) {
#ifdef __AVX512F__
  return Eight(_mm512_maskz_extractf32x8_ps(0xff, __m512(v), 1));
#else
  return joined<Eight>(four_of<2>(v), four_of<3>(v));
#endif
}
/// Groups of four lanes, by number: of a, then of b.
template <int... group, class V, std::size_t... l>
CRADLE_LANES V regrouped(const V& a, const V& b, std::index_sequence<l...>) {
  constexpr int of[] = {group...};
  return __builtin_shufflevector(a, b, (4 * of[l / 4] + int(l) % 4)...);
}
template <class V, class From>
CRADLE_LANES void load_lines_of_sixteen(V* rows, const From& from) {
  using Eight = typename HalfOfFloats<V>::Type;
  constexpr auto lanes = std::make_index_sequence<16>{};
  CRADLE_UNROLLED
  for (int l = 0; l < 4; ++l) {
    const V a = joined<V>(load_eight<Eight>(from(l)), load_eight<Eight>(from(l + 4)));
    const V b = joined<V>(load_eight<Eight>(from(l + 8)), load_eight<Eight>(from(l + 12)));
    rows[l] = regrouped<0, 2, 4, 6>(a, b, lanes);
    rows[l + 4] = regrouped<1, 3, 5, 7>(a, b, lanes);
  }
  transpose_fours(rows);
  transpose_fours(rows + 4);
}
template <class V, class Line>
CRADLE_LANES void change_lines_of_sixteen(V* rows, const Line& line) {
  constexpr auto lanes = std::make_index_sequence<16>{};
  transpose_fours(rows);
  transpose_fours(rows + 4);
  CRADLE_UNROLLED
  for (int l = 0; l < 4; ++l) {
    const V a = regrouped<0, 4, 1, 5>(rows[l], rows[l + 4], lanes);
    const V b = regrouped<2, 6, 3, 7>(rows[l], rows[l + 4], lanes);
    change_eight(line(l), lower_eight(a));
    change_eight(line(l + 4), upper_eight(a));
    change_eight(line(l + 8), lower_eight(b));
    change_eight(line(l + 12), upper_eight(b));
  }
}

/// The k-th number of the line of each lane, `from(l)`, into rows[k].
template <class V, class From>
CRADLE_LANES void load_line_rows(V* rows, const From& from) {
  if constexpr (kLanes<V> == 16) return load_lines_of_sixteen(rows, from);
  constexpr int n = kIsFloats<V> ? 4 : kLanes<V>;
  CRADLE_UNROLLED
  for (int part = 0; part < kLineNumbers; part += n) {
    const auto begin = [&](int l) CRADLE_LAMBDA { return from(l) + part; };
    if constexpr (kIsFloats<V>) {
      load_four_rows(rows + part, begin);
    } else {
      load_transposed(rows + part, begin);
    }
  }
}
/// Back, to the lines `to(l)`.
template <class V, class To>
CRADLE_LANES void store_line_rows(V* rows, const To& to) {
  CRADLE_UNROLLED
  for (int part = 0; part < kLineNumbers; part += kLanes<V>) {
    store_transposed(rows + part, [&](int l) CRADLE_LAMBDA { return to(l) + part; });
  }
}
/// Changes them by `rows`: what does not change in single precision stays as it is, to the last bit
/// of a double.
template <class V, class Line>
CRADLE_LANES void change_line_rows(V* rows, const Line& line) {
  if constexpr (kLanes<V> == 16) return change_lines_of_sixteen(rows, line);
  CRADLE_UNROLLED
  for (int part = 0; part < kLineNumbers; part += 4) {
    put_four_rows(rows + part, [&](int l, const FourFloats& by)
                                   CRADLE_LAMBDA { change_four(line(l) + part, by); });
  }
}

}  // namespace
}  // namespace cradle
