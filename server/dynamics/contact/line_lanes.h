// Lines of eight doubles to lanes and back, for the kernels' files alone (see lanes.h). Lanes of
// floats round on the way.
#pragma once

#include "server/collision/lanes.h"

namespace cradle {
namespace {

constexpr int kLineNumbers = 8;

using TwoDoubles = double __attribute__((vector_size(16)));
using TwoFloats = float __attribute__((vector_size(8)));
using FourFloats = float __attribute__((vector_size(16)));

/// So many floats.
template <class V, int lanes>
struct FloatsIn {
  typedef float Type __attribute__((vector_size(lanes * sizeof(float))));
};
template <class Half, class V, std::size_t... l>
CRADLE_LANES V joined(const Half& lower, const Half& upper, const V&, std::index_sequence<l...>) {
  return __builtin_shufflevector(lower, upper, int(l)...);
}
template <int first, class V, std::size_t... l>
CRADLE_LANES auto part_of(const V& v, std::index_sequence<l...>) {
  return __builtin_shufflevector(v, v, (first + int(l))...);
}

CRADLE_LANES FourFloats load_four(const double* from) {
#ifdef __AVX__
  return FourFloats(_mm256_cvtpd_ps(_mm256_loadu_pd(from)));
#else
  return joined(__builtin_convertvector(load<TwoDoubles>(from), TwoFloats),
                __builtin_convertvector(load<TwoDoubles>(from + 2), TwoFloats), FourFloats{},
                std::make_index_sequence<4>{});
#endif
}
CRADLE_LANES void store_four(double* to, const FourFloats& v) {
#ifdef __AVX__
  _mm256_storeu_pd(to, _mm256_cvtps_pd(__m128(v)));
#else
  constexpr auto two = std::make_index_sequence<2>{};
  store(to, __builtin_convertvector(part_of<0>(v, two), TwoDoubles));
  store(to + 2, __builtin_convertvector(part_of<2>(v, two), TwoDoubles));
#endif
}
/// Of what is `from` there, changed by as much as `now` differs from it in single precision: what
/// does not change stays as it is, to the last bit of a double.
CRADLE_LANES void change_four(double* to, const double* from, const FourFloats& now) {
  const FourFloats by = now - load_four(from);
#ifdef __AVX__
  _mm256_storeu_pd(to, _mm256_add_pd(_mm256_loadu_pd(from), _mm256_cvtps_pd(__m128(by))));
#else
  constexpr auto two = std::make_index_sequence<2>{};
  store(to, load<TwoDoubles>(from) + __builtin_convertvector(part_of<0>(by, two), TwoDoubles));
  store(to + 2,
        load<TwoDoubles>(from + 2) + __builtin_convertvector(part_of<2>(by, two), TwoDoubles));
#endif
}
/// As many of a line as there are lanes, but for the eight that there are at most.
template <class V>
CRADLE_LANES V load_floats(const double* from) {
  if constexpr (kLanes<V> == 4) {
    return load_four(from);
  } else {
    return joined(load_four(from), load_four(from + 4), V{}, std::make_index_sequence<8>{});
  }
}

/// The k-th number of the line of each lane, `from(l)`, into rows[k].
template <class V, class From>
CRADLE_LANES void load_line_rows(V* rows, const From& from) {
  constexpr int n = kLanes<V>;
  if constexpr (!kIsFloats<V>) {
    CRADLE_UNROLLED
    for (int part = 0; part < kLineNumbers; part += n) {
      load_transposed(rows + part, [&](int l) CRADLE_LAMBDA { return from(l) + part; });
    }
  } else if constexpr (n == 1) {
    for (int k = 0; k < kLineNumbers; ++k) rows[k] = static_cast<float>(from(0)[k]);
  } else if constexpr (n <= kLineNumbers) {
    CRADLE_UNROLLED
    for (int part = 0; part < kLineNumbers; part += n) {
      CRADLE_UNROLLED
      for (int l = 0; l < n; ++l) rows[part + l] = load_floats<V>(from(l) + part);
      transpose<V, n / 2>(rows + part, std::make_index_sequence<n>{});
    }
  } else {
    using Half = typename FloatsIn<V, n / 2>::Type;
    constexpr auto lanes = std::make_index_sequence<n>{};
    CRADLE_UNROLLED
    for (int l = 0; l < n / 2; ++l) {
      rows[l] = joined(load_floats<Half>(from(l)), load_floats<Half>(from(l + n / 2)), V{}, lanes);
    }
    transpose<V, n / 4, n / 2>(rows, lanes);
  }
}

/// Back: calls `put(l, part, four)` with four numbers of each lane's line, those from `part` on, of
/// the parts from `first` up to, not with, `end`.
template <int first, int end, class V, class Put>
CRADLE_LANES void put_fours(V* rows, const Put& put) {
  constexpr int n = kLanes<V>;
  constexpr auto lanes = std::make_index_sequence<n>{};
  constexpr auto four = std::make_index_sequence<4>{};
  if constexpr (n == 4) {
    CRADLE_UNROLLED
    for (int part = first; part < end; part += 4) {
      transpose<V, 2>(rows + part, lanes);
      CRADLE_UNROLLED
      for (int l = 0; l < n; ++l) put(l, part, rows[part + l]);
    }
  } else {
    transpose<V, kLineNumbers / 2, kLineNumbers>(rows, lanes);
    CRADLE_UNROLLED
    for (int l = 0; l < kLineNumbers; ++l) {
      if constexpr (first == 0) put(l, 0, part_of<0>(rows[l], four));
      if constexpr (end == kLineNumbers) put(l, 4, part_of<4>(rows[l], four));
      if constexpr (n > kLineNumbers) {
        if constexpr (first == 0) put(l + 8, 0, part_of<8>(rows[l], four));
        if constexpr (end == kLineNumbers) put(l + 8, 4, part_of<12>(rows[l], four));
      }
    }
  }
}

/// Back to the lines, `to(l)`; of what was `from(l)`, where lanes are floats.
template <class V, class From, class To>
CRADLE_LANES void store_line_rows(V* rows, const From& from, const To& to) {
  constexpr int n = kLanes<V>;
  if constexpr (kIsFloats<V>) {
    static_assert(n >= 4);
    put_fours<0, kLineNumbers>(rows, [&](int l, int part, const FourFloats& four) CRADLE_LAMBDA {
      change_four(to(l) + part, from(l) + part, four);
    });
  } else {
    CRADLE_UNROLLED
    for (int part = 0; part < kLineNumbers; part += n) {
      store_transposed(rows + part, [&](int l) CRADLE_LAMBDA { return to(l) + part; });
    }
  }
}

}  // namespace
}  // namespace cradle
