/// Several doubles, or floats, side by side: `V` is double itself or a vector of GCC's vector
/// extensions, and one text serves for all. Everything is internal to the file that includes it, so
/// that no code made for one instruction set can end up in another's place.
///
/// Every operation acts on each lane by itself, and rounds as one number does: results are the same
/// bits at every width.
#pragma once

#ifdef __SSE2__
#include <immintrin.h>
#endif

#include <cstdint>
#include <type_traits>
#include <utility>

// CRADLE_LANES, CRADLE_LAMBDA: all of a kernel is one function, so that vectors stay in registers.
// CRADLE_UNROLLED: before a loop with few turns, so that what it writes to arrays stays there, too.
#ifdef CRADLE_SANITIZED  // one such function with checks took clang 14 more than five minutes
#define CRADLE_LANES inline
#define CRADLE_LAMBDA
#define CRADLE_UNROLLED
#else
#define CRADLE_LANES [[gnu::always_inline]] inline
#define CRADLE_LAMBDA __attribute__((always_inline))
#ifdef __clang__
#define CRADLE_UNROLLED _Pragma("unroll")
#else
#define CRADLE_UNROLLED _Pragma("GCC unroll 8")
#endif
#endif

namespace cradle {
namespace {

template <class V>
constexpr auto number_of(const V& v) {
  if constexpr (requires { v[0]; }) {
    return std::remove_cvref_t<decltype(v[0])>{};
  } else {
    return v;
  }
}
/// double or float.
template <class V>
using NumberOf = decltype(number_of(V{}));
template <class V>
inline constexpr int kLanes = static_cast<int>(sizeof(V) / sizeof(NumberOf<V>));
template <class V>
inline constexpr bool kIsFloats = std::is_same_v<NumberOf<V>, float>;

/// Copied member by member: what the compiler copies as a block goes through memory, in pieces that
/// are not those in which it is then read.
template <class V>
struct Triple {
  V x, y, z;
  Triple() = default;
  CRADLE_LANES Triple(const V& x_, const V& y_, const V& z_) : x(x_), y(y_), z(z_) {}
  CRADLE_LANES Triple(const Triple& t) : x(t.x), y(t.y), z(t.z) {}
  CRADLE_LANES Triple& operator=(const Triple& t) {
    x = t.x;
    y = t.y;
    z = t.z;
    return *this;
  }
};
template <class V>
struct Quadruple {  // a quaternion, w is its scalar part
  V x, y, z, w;
};

template <class V>
CRADLE_LANES Triple<V> operator+(const Triple<V>& a, const Triple<V>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class V>
CRADLE_LANES Triple<V> operator-(const Triple<V>& a, const Triple<V>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class V, class S>
CRADLE_LANES Triple<V> operator*(const S& s, const Triple<V>& a) {
  return {s * a.x, s * a.y, s * a.z};
}
/// By component.
template <class V>
CRADLE_LANES Triple<V> operator*(const Triple<V>& a, const Triple<V>& b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}
template <class V>
CRADLE_LANES Triple<V> cross(const Triple<V>& a, const Triple<V>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class V>
CRADLE_LANES V dot(const Triple<V>& a, const Triple<V>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

// What the compiler does not make of comparisons by itself: one instruction each.

/// a > b ? a : b
template <class V>
CRADLE_LANES V larger(const V& a, const V& b) {
#ifdef __SSE2__
  if constexpr (sizeof(V) == 16) {
    if constexpr (kIsFloats<V>) return V(_mm_max_ps(__m128(a), __m128(b)));
    return V(_mm_max_pd(__m128d(a), __m128d(b)));
  }
#endif
#ifdef __AVX2__
  if constexpr (sizeof(V) == 32) {
    if constexpr (kIsFloats<V>) return V(_mm256_max_ps(__m256(a), __m256(b)));
    return V(_mm256_max_pd(__m256d(a), __m256d(b)));
  }
#endif
#ifdef __AVX512F__
  if constexpr (sizeof(V) == 64) {
    if constexpr (kIsFloats<V>) return V(_mm512_maskz_max_ps(0xffff, __m512(a), __m512(b)));
    return V(_mm512_maskz_max_pd(0xff, __m512d(a), __m512d(b)));
  }
#endif
  return a > b ? a : b;
}

/// a < b ? a : b
template <class V>
CRADLE_LANES V smaller(const V& a, const V& b) {
#ifdef __SSE2__
  if constexpr (sizeof(V) == 16) {
    if constexpr (kIsFloats<V>) return V(_mm_min_ps(__m128(a), __m128(b)));
    return V(_mm_min_pd(__m128d(a), __m128d(b)));
  }
#endif
#ifdef __AVX2__
  if constexpr (sizeof(V) == 32) {
    if constexpr (kIsFloats<V>) return V(_mm256_min_ps(__m256(a), __m256(b)));
    return V(_mm256_min_pd(__m256d(a), __m256d(b)));
  }
#endif
#ifdef __AVX512F__
  if constexpr (sizeof(V) == 64) {
    if constexpr (kIsFloats<V>) return V(_mm512_maskz_min_ps(0xffff, __m512(a), __m512(b)));
    return V(_mm512_maskz_min_pd(0xff, __m512d(a), __m512d(b)));
  }
#endif
  return a < b ? a : b;
}

/// Without its sign.
template <class V>
CRADLE_LANES V size_of(const V& x) {
  if constexpr (kLanes<V> == 1) {
    return static_cast<V>(__builtin_fabs(x));
  } else {
    using Bits = decltype(x < x);
    return V(Bits(x) & ~Bits(-V{}));
  }
}

template <class V>
CRADLE_LANES V root(const V& x) {
  if constexpr (kLanes<V> == 1) {
    return static_cast<V>(__builtin_sqrt(x));  // of a float rounded twice, to the same
#ifdef __SSE2__
  } else if constexpr (sizeof(V) == 16) {
    if constexpr (kIsFloats<V>) return V(_mm_sqrt_ps(__m128(x)));
    return V(_mm_sqrt_pd(__m128d(x)));
#endif
#ifdef __AVX2__
  } else if constexpr (sizeof(V) == 32) {
    if constexpr (kIsFloats<V>) return V(_mm256_sqrt_ps(__m256(x)));
    return V(_mm256_sqrt_pd(__m256d(x)));
#endif
#ifdef __AVX512F__
  } else if constexpr (sizeof(V) == 64) {
    if constexpr (kIsFloats<V>) return V(_mm512_maskz_sqrt_ps(0xffff, __m512(x)));
    return V(_mm512_maskz_sqrt_pd(0xff, __m512d(x)));
#endif
  } else {
    V r;
    for (int l = 0; l < kLanes<V>; ++l) r[l] = root(x[l]);
    return r;
  }
}
// Choosing by lane.

template <class M, class V>
CRADLE_LANES V select(const M& mask, const V& a, const V& b) {
  return mask ? a : b;
}
template <class M, class V>
CRADLE_LANES Triple<V> select(const M& mask, const Triple<V>& a, const Triple<V>& b) {
  return {select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z)};
}
template <class M, class V>
CRADLE_LANES Quadruple<V> select(const M& mask, const Quadruple<V>& a, const Quadruple<V>& b) {
  return {mask ? a.x : b.x, mask ? a.y : b.y, mask ? a.z : b.z, mask ? a.w : b.w};
}

/// Lane `l` of a vector or of a mask.
template <class M>
CRADLE_LANES auto lane(const M& mask, int l) {
  if constexpr (requires { mask[0]; }) {
    return mask[l];
  } else {
    return mask;
  }
}

/// A bit for each of two lanes.
template <class M>
CRADLE_LANES unsigned bits_of(const M& mask) {
  static_assert(sizeof(M) == 2 * sizeof(double));
#ifdef __SSE2__
  return static_cast<unsigned>(_mm_movemask_pd(__m128d(mask)));
#else
  return static_cast<unsigned>(mask[0] & 1) | static_cast<unsigned>(mask[1] & 2);
#endif
}

/// A bit for each float of a vector: its sign.
template <class F>
CRADLE_LANES std::uint32_t signs_of(const F& floats) {
#ifdef __SSE2__
  if constexpr (sizeof(F) == 16) {
    return static_cast<std::uint32_t>(_mm_movemask_ps(__m128(floats)));
  }
#endif
#ifdef __AVX2__
  if constexpr (sizeof(F) == 32) {
    return static_cast<std::uint32_t>(_mm256_movemask_ps(__m256(floats)));
  }
#endif
#ifdef __AVX512DQ__
  if constexpr (sizeof(F) == 64) return _mm512_movepi32_mask(__m512i(floats));
#endif
  std::uint32_t bits = 0;
  for (std::size_t l = 0; l < sizeof(F) / sizeof(float); ++l) {
    bits |= __builtin_signbit(floats[l]) ? 1U << l : 0U;
  }
  return bits;
}

/// The mask with its halves or-ed together, until the first lane knows of all.
template <int distance, class M, std::size_t... l>
CRADLE_LANES M folded(const M& mask, std::index_sequence<l...> lanes) {
  const M m = mask | __builtin_shufflevector(mask, mask, (int(l) ^ distance)...);
  if constexpr (distance > 1) return folded<distance / 2>(m, lanes);
  return m;
}

template <class V, class M>
CRADLE_LANES bool any(const M& mask) {
  if constexpr (kLanes<V> == 1) {
    return mask;
#ifdef __SSE2__
  } else if constexpr (sizeof(V) == 16) {
    if constexpr (kIsFloats<V>) return _mm_movemask_ps(__m128(mask)) != 0;
    return _mm_movemask_pd(__m128d(mask)) != 0;
#endif
#ifdef __AVX2__
  } else if constexpr (sizeof(V) == 32) {
    if constexpr (kIsFloats<V>) return _mm256_movemask_ps(__m256(mask)) != 0;
    return _mm256_movemask_pd(__m256d(mask)) != 0;
#endif
#ifdef __AVX512DQ__
  } else if constexpr (sizeof(V) == 64) {
    if constexpr (kIsFloats<V>) return _mm512_movepi32_mask(__m512i(mask)) != 0;
    return _mm512_movepi64_mask(__m512i(mask)) != 0;
#endif
  } else {
    return folded<kLanes<V> / 2>(mask, std::make_index_sequence<kLanes<V>>{})[0] != 0;
  }
}
template <class V, class M>
CRADLE_LANES bool all(const M& mask) {
  return !any<V>(mask == M{});
}

// Between arrays and lanes.

template <class V>
CRADLE_LANES V fill(double value) {
  return NumberOf<V>(value) - V{};  // x - 0 is x, and costs nothing; x + 0 would be added up
}

template <class V>
CRADLE_LANES V load(const NumberOf<V>* from) {
  using Anywhere [[gnu::aligned(alignof(NumberOf<V>)), gnu::may_alias]] = V;
  return *reinterpret_cast<const Anywhere*>(from);
}
template <class V>
CRADLE_LANES void store(NumberOf<V>* to, const V& v) {
  using Anywhere [[gnu::aligned(alignof(NumberOf<V>)), gnu::may_alias]] = V;
  *reinterpret_cast<Anywhere*>(to) = v;
}

/// Element l of row k becomes element k of row l: one bit of both numbers after the other.
template <class V, int distance, std::size_t... l>
CRADLE_LANES void transpose(V* rows, std::index_sequence<l...> lanes) {
  constexpr int n = kLanes<V>;
  CRADLE_UNROLLED
  for (int k = 0; k < n; ++k) {
    if ((k & distance) != 0) continue;
    const V a = rows[k], b = rows[k + distance];
    rows[k] =
        __builtin_shufflevector(a, b, ((int(l) & distance) ? n + (int(l) ^ distance) : int(l))...);
    rows[k + distance] =
        __builtin_shufflevector(a, b, ((int(l) & distance) ? n + int(l) : (int(l) ^ distance))...);
  }
  if constexpr (distance > 1) transpose<V, distance / 2>(rows, lanes);
}

/// Half as many lanes, of doubles. What moves halves can read and write memory as it goes; shuffles
/// of whole vectors all wait for the same unit.
template <class V>
struct HalfOf {
  typedef double Type __attribute__((vector_size(sizeof(V) / 2)));
};
template <class V, std::size_t... l>
CRADLE_LANES V load_halves(const double* lower, const double* upper, std::index_sequence<l...>) {
  using Half = typename HalfOf<V>::Type;
  const Half lo = load<Half>(lower), hi = load<Half>(upper);
#ifdef __AVX512F__  // not what the compiler makes of the shuffle
  if constexpr (kLanes<V> == 8) {
    return V(_mm512_maskz_insertf64x4(0xff, _mm512_castpd256_pd512(__m256d(lo)), __m256d(hi), 1));
  }
#endif
  return __builtin_shufflevector(lo, hi, int(l)...);
}
template <class V, std::size_t... l>
CRADLE_LANES void store_halves(double* lower, double* upper, const V& v,
                               std::index_sequence<l...>) {
  store(lower, __builtin_shufflevector(v, v, int(l)...));
#ifdef __AVX__  // likewise
  if constexpr (kLanes<V> == 4) {
    return _mm_storeu_pd(upper, _mm256_extractf128_pd(__m256d(v), 1));
  }
#endif
#ifdef __AVX512F__
  if constexpr (kLanes<V> == 8) {
    return _mm256_storeu_pd(upper, _mm512_maskz_extractf64x4_pd(0xf, __m512d(v), 1));
  }
#endif
  store(upper, __builtin_shufflevector(v, v, (int(l) + kLanes<V> / 2)...));
}

/// As many numbers as there are lanes from each of as many places, `from(l)`: the k-th of all into
/// rows[k].
template <class V, class From>
CRADLE_LANES void load_transposed(V* rows, const From& from) {
  constexpr int n = kLanes<V>, half = n / 2;
  constexpr auto lanes = std::make_index_sequence<n>{};
  if constexpr (n < 4) {
    CRADLE_UNROLLED
    for (int l = 0; l < n; ++l) rows[l] = load<V>(from(l));
    if constexpr (n > 1) transpose<V, half>(rows, lanes);
  } else {
    CRADLE_UNROLLED
    for (int l = 0; l < half; ++l) {
      rows[l] = load_halves<V>(from(l), from(l + half), lanes);
      rows[l + half] = load_halves<V>(from(l) + half, from(l + half) + half, lanes);
    }
    transpose<V, half / 2>(rows, lanes);
  }
}
/// Back to them, `to(l)`.
template <class V, class To>
CRADLE_LANES void store_transposed(V* rows, const To& to) {
  constexpr int n = kLanes<V>, half = n / 2;
  constexpr auto lanes = std::make_index_sequence<n>{};
  if constexpr (n < 4) {
    if constexpr (n > 1) transpose<V, half>(rows, lanes);
    CRADLE_UNROLLED
    for (int l = 0; l < n; ++l) store(to(l), rows[l]);
  } else {
    constexpr auto of_half = std::make_index_sequence<half>{};
    transpose<V, half / 2>(rows, lanes);
    CRADLE_UNROLLED
    for (int l = 0; l < half; ++l) {
      store_halves<V>(to(l), to(l + half), rows[l], of_half);
      store_halves<V>(to(l) + half, to(l + half) + half, rows[l + half], of_half);
    }
  }
}

/// Of `size` numbers that each lane points to, from `begin` on, those from `first` up to, not with,
/// `end`, and what lies with them in a vector: the k-th of all lanes to `to[k]`. With a last part
/// that begins earlier if need be.
template <int size, int first = 0, int end = size, class V>
CRADLE_LANES void load_columns(V* to, const double* const* lanes, int begin = 0) {
  constexpr int n = kLanes<V>;
  CRADLE_UNROLLED
  for (int part = first / n * n; part < end; part += n) {
    const int at = part < size - n ? part : size - n;
    load_transposed(to + at, [&](int l) CRADLE_LAMBDA { return lanes[l] + begin + at; });
  }
}

}  // namespace
}  // namespace cradle
