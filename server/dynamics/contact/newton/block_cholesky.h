/// A sparse symmetric matrix of 6 x 6 blocks, one row of them a body, and its Cholesky factor: see
/// block_cholesky.cpp.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "server/dynamics/contact/newton/block_kernels.h"

namespace cradle {

struct BlockPair {
  std::int32_t a, b;  ///< bodies, not the same
  friend bool operator==(const BlockPair&, const BlockPair&) = default;
};

/// Keeps its memory from matrix to matrix.
class BlockCholesky {
 public:
  using Block = Eigen::Matrix<double, 6, 6>;

  /// Of the widest kernels that the machine has, unless it is told to use others.
  void use(const BlockKernels& kernels) { kernels_ = &kernels; }

  /// Which blocks there are beside the diagonal. What it finds it keeps for as long as it is asked
  /// for the same.
  void analyse(std::size_t bodies, std::span<const BlockPair> pairs);

  void set_zero();
  void add(std::int32_t body, const Block& block);
  /// Of the k-th pair, in row a and column b; the other half is its transpose.
  void add_pair(std::size_t k, const Block& block);

  /// False where the matrix is not positive definite. Overwrites it.
  bool factor();
  void solve(Eigen::Ref<Eigen::VectorXd> x) const;

  /// Of the factor, beside the diagonal.
  std::size_t blocks() const { return row_.size(); }

 private:
  struct Place {
    std::size_t block;
    bool is_transposed;
  };
  struct Entry {
    std::int32_t column;
    std::size_t block;
  };
  void order(std::span<const BlockPair> pairs);
  void find_columns(std::span<const BlockPair> pairs);
  void find_rows();
  std::span<const std::int32_t> rows_of(std::size_t column) const;

  const BlockKernels* kernels_ = &block_kernels_of(0);
  std::size_t bodies_ = 0;
  std::vector<BlockPair> pairs_;
  std::vector<std::int32_t> position_;    // by body
  std::vector<std::int32_t> body_;        // by position
  std::vector<std::size_t> first_;        // block of each column, and the end
  std::vector<std::int32_t> row_;         // by block
  std::vector<std::size_t> row_first_;    // entry of each row, and the end
  std::vector<Entry> entries_;            // blocks by row
  std::vector<Place> places_;             // by pair
  std::vector<Block> blocks_, diagonal_;  // of the matrix, then of the factor: the inverse diagonal
  std::vector<std::size_t> target_;       // by row, while a column is worked on
  std::vector<BlockProduct> products_;    // of an entry
  mutable Eigen::VectorXd ordered_;
};

}  // namespace cradle
