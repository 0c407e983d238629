/// Several doubles side by side: `V` is double itself or a vector of GCC's vector extensions, and
/// one text serves for all. Everything is internal to the file that includes it, so
/// that no code made for one instruction set can end up in another's place.
///
/// Every operation acts on each lane by itself, and rounds as a double does: results are the same
/// bits at every width.
#pragma once

#ifdef __SSE2__
#include <immintrin.h>
#endif

#include <cstdint>
#include <utility>

/// All of a kernel is one function: vectors stay in registers.
#define CRADLE_LANES [[gnu::always_inline]] inline
#define CRADLE_LAMBDA __attribute__((always_inline))
/// Before a loop with few turns: what it writes to arrays of vectors stays in registers, too.
#ifdef __clang__
#define CRADLE_UNROLLED _Pragma("unroll")
#else
#define CRADLE_UNROLLED _Pragma("GCC unroll 8")
#endif

namespace cradle {
namespace {

template <class V>
inline constexpr int kLanes = static_cast<int>(sizeof(V) / sizeof(double));

/// Two vectors as one: what works on one of them after the other waits for each result, what works
/// on both has something else to do meanwhile. Of doubles, or of masks.
template <class V>
struct Twin {
  V lo, hi;
};
template <class V>
concept IsTwin = requires(V v) {
  v.lo, v.hi;
};

// Of each of both.
template <class V>
CRADLE_LANES Twin<V> operator-(const Twin<V>& a) {
  return {-a.lo, -a.hi};
}
#define CRADLE_OF_TWIN(op)                                            \
  template <class V>                                                  \
  CRADLE_LANES auto operator op(const Twin<V>& a, const Twin<V>& b) { \
    return Twin<decltype(a.lo op b.lo)>{a.lo op b.lo, a.hi op b.hi};  \
  }
CRADLE_OF_TWIN(+)
CRADLE_OF_TWIN(-)
CRADLE_OF_TWIN(*)
CRADLE_OF_TWIN(/)
CRADLE_OF_TWIN(<)
CRADLE_OF_TWIN(>)
CRADLE_OF_TWIN(<=)
CRADLE_OF_TWIN(>=)
CRADLE_OF_TWIN(==)
CRADLE_OF_TWIN(&)
CRADLE_OF_TWIN(|)
#undef CRADLE_OF_TWIN
template <class V>
CRADLE_LANES Twin<V> operator+(const Twin<V>& a, double b) {
  return {a.lo + b, a.hi + b};
}
template <class V>
CRADLE_LANES Twin<V> operator+(double a, const Twin<V>& b) {
  return {a + b.lo, a + b.hi};
}
template <class V>
CRADLE_LANES Twin<V> operator*(double a, const Twin<V>& b) {
  return {a * b.lo, a * b.hi};
}
template <class V>
CRADLE_LANES Twin<V> operator/(double a, const Twin<V>& b) {
  return {a / b.lo, a / b.hi};
}
template <class V>
CRADLE_LANES Twin<V> operator/(const Twin<V>& a, double b) {
  return {a.lo / b, a.hi / b};
}

template <class V>
struct Triple {
  V x, y, z;
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
  if constexpr (IsTwin<V>) {
    return {larger(a.lo, b.lo), larger(a.hi, b.hi)};
#ifdef __SSE2__
  } else if constexpr (kLanes<V> == 2) {
    return V(_mm_max_pd(__m128d(a), __m128d(b)));
#endif
#ifdef __AVX2__
  } else if constexpr (kLanes<V> == 4) {
    return V(_mm256_max_pd(__m256d(a), __m256d(b)));
#endif
#ifdef __AVX512F__
  } else if constexpr (kLanes<V> == 8) {
    return V(_mm512_maskz_max_pd(0xff, __m512d(a), __m512d(b)));
#endif
  } else {
    return a > b ? a : b;
  }
}

/// a < b ? a : b
template <class V>
CRADLE_LANES V smaller(const V& a, const V& b) {
  if constexpr (IsTwin<V>) {
    return {smaller(a.lo, b.lo), smaller(a.hi, b.hi)};
#ifdef __SSE2__
  } else if constexpr (kLanes<V> == 2) {
    return V(_mm_min_pd(__m128d(a), __m128d(b)));
#endif
#ifdef __AVX2__
  } else if constexpr (kLanes<V> == 4) {
    return V(_mm256_min_pd(__m256d(a), __m256d(b)));
#endif
#ifdef __AVX512F__
  } else if constexpr (kLanes<V> == 8) {
    return V(_mm512_maskz_min_pd(0xff, __m512d(a), __m512d(b)));
#endif
  } else {
    return a < b ? a : b;
  }
}

/// Without its sign.
template <class V>
CRADLE_LANES V size_of(const V& x) {
  if constexpr (IsTwin<V>) {
    return {size_of(x.lo), size_of(x.hi)};
  } else if constexpr (kLanes<V> == 1) {
    return __builtin_fabs(x);
  } else {
    using Bits = decltype(x < x);
    return V(Bits(x) & ~Bits(-V{}));
  }
}

template <class V>
CRADLE_LANES V root(const V& x) {
  if constexpr (IsTwin<V>) {
    return {root(x.lo), root(x.hi)};
  } else if constexpr (kLanes<V> == 1) {
    return __builtin_sqrt(x);
#ifdef __SSE2__
  } else if constexpr (kLanes<V> == 2) {
    return V(_mm_sqrt_pd(__m128d(x)));
#endif
#ifdef __AVX2__
  } else if constexpr (kLanes<V> == 4) {
    return V(_mm256_sqrt_pd(__m256d(x)));
#endif
#ifdef __AVX512F__
  } else if constexpr (kLanes<V> == 8) {
    return V(_mm512_maskz_sqrt_pd(0xff, __m512d(x)));
#endif
  } else {
    V r;
    for (int l = 0; l < kLanes<V>; ++l) r[l] = __builtin_sqrt(x[l]);
    return r;
  }
}
// Choosing by lane.

template <class M, class V>
CRADLE_LANES V select(const M& mask, const V& a, const V& b) {
  if constexpr (IsTwin<M>) {
    return {select(mask.lo, a.lo, b.lo), select(mask.hi, a.hi, b.hi)};
  } else {
    return mask ? a : b;
  }
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

/// A bit for each float of a vector: it is negative.
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
  std::uint32_t bits = 0;
  for (std::size_t l = 0; l < sizeof(F) / sizeof(float); ++l) {
    bits |= floats[l] < 0 ? 1U << l : 0U;
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
  if constexpr (IsTwin<V>) {
    return any<decltype(V::lo)>(mask.lo | mask.hi);
  } else if constexpr (kLanes<V> == 1) {
    return mask;
#ifdef __SSE2__
  } else if constexpr (kLanes<V> == 2) {
    return _mm_movemask_pd(__m128d(mask)) != 0;
#endif
#ifdef __AVX2__
  } else if constexpr (kLanes<V> == 4) {
    return _mm256_movemask_pd(__m256d(mask)) != 0;
#endif
#ifdef __AVX512DQ__
  } else if constexpr (kLanes<V> == 8) {
    return _mm512_movepi64_mask(__m512i(mask)) != 0;
#endif
  } else {
    return folded<kLanes<V> / 2>(mask, std::make_index_sequence<kLanes<V>>{})[0] != 0;
  }
}
template <class V, class M>
CRADLE_LANES bool all(const M& mask) {
  if constexpr (IsTwin<V>) {
    return all<decltype(V::lo)>(mask.lo & mask.hi);
  } else {
    return !any<V>(mask == M{});
  }
}

// Between arrays of bodies and lanes.

// Where the bodies of a block are: slots in a row are moved by whole vectors, others one by one.
struct Row {
  std::int32_t first;
  std::int32_t slot(int l) const { return first + l; }
};
struct Scattered {
  const std::int32_t* slots;
  std::int32_t slot(int l) const { return slots[l]; }
};

/// `slots` ascend, but for the last one, which may be repeated.
template <class V>
CRADLE_LANES bool are_in_a_row(const std::int32_t* slots) {
  constexpr int n = kLanes<V>;
  return slots[n - 1] - slots[0] == n - 1 && slots[n - 2] != slots[n - 1];
}

template <class V>
CRADLE_LANES V fill(double value) {
  return V{} + value;
}

template <class V>
CRADLE_LANES V load(const double* from) {
  if constexpr (IsTwin<V>) {
    using Half = decltype(V::lo);
    return {load<Half>(from), load<Half>(from + kLanes<Half>)};
  } else {
    using Anywhere [[gnu::aligned(alignof(double)), gnu::may_alias]] = V;
    return *reinterpret_cast<const Anywhere*>(from);
  }
}
template <class V>
CRADLE_LANES void store(double* to, const V& v) {
  if constexpr (IsTwin<V>) {
    store(to, v.lo);
    store(to + kLanes<decltype(v.lo)>, v.hi);
  } else {
    using Anywhere [[gnu::aligned(alignof(double)), gnu::may_alias]] = V;
    *reinterpret_cast<Anywhere*>(to) = v;
  }
}

/// Lane l of the result is element `Index` of a and b laid end to end.
template <class V, int... Index>
CRADLE_LANES V pick(const V& a, const V& b) {
  return __builtin_shufflevector(a, b, Index...);
}

// Rows of bodies to columns of components: component c of lane l is number width l + c of the row,
// and back. Of three vectors a third each belongs to a component, every number in a place of its
// own: they are blended first, and moved across lanes once, which costs more.

/// Which of three vectors has component c in place p.
template <class V>
constexpr int vector_with(int c, int p) {
  for (int r = 0; r < 3; ++r) {
    if ((kLanes<V> * r + p) % 3 == c) return r;
  }
  return 0;
}
template <class V, int c, std::size_t... p>
CRADLE_LANES V component_of_3(const V& r0, const V& r1, const V& r2, std::index_sequence<p...>) {
  constexpr int n = kLanes<V>;
  const V two = pick<V, (vector_with<V>(c, int(p)) == 1 ? n + int(p) : int(p))...>(r0, r1);
  const V all = pick<V, (vector_with<V>(c, int(p)) == 2 ? n + int(p) : int(p))...>(two, r2);
  return pick<V, ((3 * int(p) + c) % n)...>(all, all);
}

/// Lane l goes to place (3 l + c) % n.
template <class V, int c, std::size_t... p>
CRADLE_LANES V spread_by_3(const V& component, std::index_sequence<p...>) {
  return pick<V, ((kLanes<V> * vector_with<V>(c, int(p)) + int(p)) / 3)...>(component, component);
}
template <class V, int r, std::size_t... p>
CRADLE_LANES V row_of_3(const V& x, const V& y, const V& z, std::index_sequence<p...>) {
  constexpr int n = kLanes<V>;
  const V xy = pick<V, ((n * r + int(p)) % 3 == 1 ? n + int(p) : int(p))...>(x, y);
  return pick<V, ((n * r + int(p)) % 3 == 2 ? n + int(p) : int(p))...>(xy, z);
}

template <class V, int c, std::size_t... l>
CRADLE_LANES V component_of_4(const V& r0, const V& r1, const V& r2, const V& r3,
                              std::index_sequence<l...>) {
  constexpr int n = kLanes<V>;
  const V first = pick<V, (4 * int(l) + c < 2 * n ? 4 * int(l) + c : 0)...>(r0, r1);
  const V last = pick<V, (4 * int(l) + c < 2 * n ? 0 : 4 * int(l) + c - 2 * n)...>(r2, r3);
  return pick<V, (4 * int(l) + c < 2 * n ? int(l) : n + int(l))...>(first, last);
}

template <class V, int r, std::size_t... e>
CRADLE_LANES V row_of_4(const Quadruple<V>& q, std::index_sequence<e...>) {
  constexpr int n = kLanes<V>;
  const V xy = pick<V, ((n * r + int(e)) % 4 % 2 * n + (n * r + int(e)) / 4)...>(q.x, q.y);
  const V zw = pick<V, ((n * r + int(e)) % 4 % 2 * n + (n * r + int(e)) / 4)...>(q.z, q.w);
  return pick<V, ((n * r + int(e)) % 4 < 2 ? int(e) : n + int(e))...>(xy, zw);
}

template <class V>
CRADLE_LANES Triple<V> load3(const double* from, const Row& row) {
  constexpr int n = kLanes<V>;
  constexpr auto all = std::make_index_sequence<n>{};
  from += 3 * row.first;
  const V r0 = load<V>(from), r1 = load<V>(from + n), r2 = load<V>(from + 2 * n);
  return {component_of_3<V, 0>(r0, r1, r2, all), component_of_3<V, 1>(r0, r1, r2, all),
          component_of_3<V, 2>(r0, r1, r2, all)};
}
template <class V>
CRADLE_LANES Quadruple<V> load4(const double* from, const Row& row) {
  constexpr int n = kLanes<V>;
  constexpr auto all = std::make_index_sequence<n>{};
  from += 4 * row.first;
  const V r0 = load<V>(from), r1 = load<V>(from + n);
  const V r2 = load<V>(from + 2 * n), r3 = load<V>(from + 3 * n);
  return {component_of_4<V, 0>(r0, r1, r2, r3, all), component_of_4<V, 1>(r0, r1, r2, r3, all),
          component_of_4<V, 2>(r0, r1, r2, r3, all), component_of_4<V, 3>(r0, r1, r2, r3, all)};
}
template <class V>
CRADLE_LANES void store3(double* to, const Row& row, const Triple<V>& t) {
  constexpr int n = kLanes<V>;
  constexpr auto all = std::make_index_sequence<n>{};
  to += 3 * row.first;
  const V x = spread_by_3<V, 0>(t.x, all);
  const V y = spread_by_3<V, 1>(t.y, all);
  const V z = spread_by_3<V, 2>(t.z, all);
  store(to, row_of_3<V, 0>(x, y, z, all));
  store(to + n, row_of_3<V, 1>(x, y, z, all));
  store(to + 2 * n, row_of_3<V, 2>(x, y, z, all));
}
template <class V>
CRADLE_LANES void store4(double* to, const Row& row, const Quadruple<V>& q) {
  constexpr int n = kLanes<V>;
  constexpr auto all = std::make_index_sequence<n>{};
  to += 4 * row.first;
  store(to, row_of_4<V, 0>(q, all));
  store(to + n, row_of_4<V, 1>(q, all));
  store(to + 2 * n, row_of_4<V, 2>(q, all));
  store(to + 3 * n, row_of_4<V, 3>(q, all));
}

template <class V>
CRADLE_LANES V gather(const double* from, const Scattered& bodies, int width, int component) {
  if constexpr (kLanes<V> == 1) {
    return from[width * bodies.slot(0) + component];
  } else {
    V v;
    for (int l = 0; l < kLanes<V>; ++l) v[l] = from[width * bodies.slot(l) + component];
    return v;
  }
}
template <class V>
CRADLE_LANES void scatter(double* to, const Scattered& bodies, int width, int component,
                          const V& v) {
  for (int l = 0; l < kLanes<V>; ++l) to[width * bodies.slot(l) + component] = lane(v, l);
}
template <class V>
CRADLE_LANES Triple<V> load3(const double* from, const Scattered& bodies) {
  return {gather<V>(from, bodies, 3, 0), gather<V>(from, bodies, 3, 1),
          gather<V>(from, bodies, 3, 2)};
}
template <class V>
CRADLE_LANES Quadruple<V> load4(const double* from, const Scattered& bodies) {
  return {gather<V>(from, bodies, 4, 0), gather<V>(from, bodies, 4, 1),
          gather<V>(from, bodies, 4, 2), gather<V>(from, bodies, 4, 3)};
}
template <class V>
CRADLE_LANES void store3(double* to, const Scattered& bodies, const Triple<V>& t) {
  scatter(to, bodies, 3, 0, t.x);
  scatter(to, bodies, 3, 1, t.y);
  scatter(to, bodies, 3, 2, t.z);
}
template <class V>
CRADLE_LANES void store4(double* to, const Scattered& bodies, const Quadruple<V>& q) {
  scatter(to, bodies, 4, 0, q.x);
  scatter(to, bodies, 4, 1, q.y);
  scatter(to, bodies, 4, 2, q.z);
  scatter(to, bodies, 4, 3, q.w);
}

}  // namespace
}  // namespace cradle
