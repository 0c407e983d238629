/// Products of 6 x 6 blocks, rows of a column side by side. For one file a width to include.
#pragma once

#include "server/collision/lanes.h"
#include "server/dynamics/contact/newton/block_kernels.h"

namespace cradle {
namespace {

template <class V>
CRADLE_LANES V rows_at(const double* column) {
  V value;
  __builtin_memcpy(&value, column, sizeof value);
  return value;
}

/// Of these rows, all columns.
template <class V>
CRADLE_LANES void subtract_rows(double* C, const double* A, const double* B) {
  V c[kBlockSide];
  for (std::size_t j = 0; j < kBlockSide; ++j) c[j] = rows_at<V>(C + kBlockSide * j);
  for (std::size_t k = 0; k < kBlockSide; ++k) {
    const V a = rows_at<V>(A + kBlockSide * k);
    for (std::size_t j = 0; j < kBlockSide; ++j) c[j] = c[j] - a * B[kBlockSide * k + j];
  }
  for (std::size_t j = 0; j < kBlockSide; ++j)
    __builtin_memcpy(C + kBlockSide * j, &c[j], sizeof(V));
}

/// `Rest`: for the rows that V leaves over.
template <class V, class Rest>
void subtract(const BlockProduct* products, std::size_t count, const double* B) {
  for (std::size_t i = 0; i < count; ++i) {
    const auto [A, C] = products[i];
    std::size_t row = 0;
    for (; row + kLanes<V> <= kBlockSide; row += kLanes<V>) subtract_rows<V>(C + row, A + row, B);
    if constexpr (kBlockSide % kLanes<V> != 0) subtract_rows<Rest>(C + row, A + row, B);
  }
}

template <class V, class Rest = V>
constexpr BlockKernels block_kernels() {
  return {kLanes<V>, subtract<V, Rest>};
}

}  // namespace
}  // namespace cradle
