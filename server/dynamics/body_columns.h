// Arrays of bodies to columns of numbers and back, for the kernels' files alone (see lanes.h).
#pragma once

#include <cstdint>
#include <utility>

#include "server/collision/lanes.h"

namespace cradle {
namespace {

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
