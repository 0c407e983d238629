/// Products of 6 x 6 blocks, for each width of the machine.
#pragma once

#include <cstddef>

namespace cradle {

inline constexpr std::size_t kBlockSide = 6;

/// Blocks by their first number, column by column.
struct BlockProduct {
  const double* A;
  double* C;
};

struct BlockKernels {
  int lanes;  ///< rows side by side
  /// C -= A B^T for each of the products, by ascending columns of A: the same bits at every width.
  void (*subtract)(const BlockProduct* products, std::size_t count, const double* B);
};

/// The widest of at most so many lanes, one of machine_lanes(); or 0: the most.
const BlockKernels& block_kernels_of(int lanes);

/// Of eight, six of which would be masked, loads wait for stores: they take longer than four and
/// two.
extern const BlockKernels kBlockKernels1, kBlockKernels2, kBlockKernels4;

}  // namespace cradle
