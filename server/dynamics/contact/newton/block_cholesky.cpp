// Cholesky factor of a sparse matrix of 6 x 6 blocks: P A P^T = L L^T.
//
// Sources: Amestoy, Davis and Duff (1996) for the order P, approximate minimum degree, by Eigen on
// the graph of the bodies; Liu (1990), "The role of elimination trees in sparse factorization", for
// the pattern; left-looking columns.
//   column j:  C_ij = A_ij - sum_k<j L_ik L_jk^T;  L_jj L_jj^T = C_jj;  L_ij = C_ij L_jj^-T
// Where we differ: of the diagonal L_jj^-1 is kept, so that a column is made by products alone.
//
// Order: exact. Sums go by ascending k, so that they are the same for the same pattern, and at
// every width of the products (block_kernels.h). Cost: 36 ns a product of blocks by two rows at a
// time, less by four: of 5050 cubes, where they come from far, a tick takes a quarter less. A
// pyramid of 465 cubes has 3666 blocks and takes 27000 products, 1.0 ms, and 0.3 ms to find its
// pattern; Eigen's SimplicialLDLT, by single numbers, 4.8 and 3.0.
#include "server/dynamics/contact/newton/block_cholesky.h"

#include <Eigen/Cholesky>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cassert>

#include "server/collision/index.h"

namespace cradle {
namespace {

using Block = BlockCholesky::Block;

}  // namespace

std::span<const std::int32_t> BlockCholesky::rows_of(std::size_t column) const {
  return std::span(row_).subspan(first_[column], first_[column + 1] - first_[column]);
}

void BlockCholesky::analyse(std::size_t bodies, std::span<const BlockPair> pairs) {
  if (bodies == bodies_ && std::ranges::equal(pairs, pairs_)) return;
  bodies_ = bodies;
  pairs_.assign(pairs.begin(), pairs.end());
  order(pairs);
  find_columns(pairs);
  find_rows();
  blocks_.resize(row_.size());
  diagonal_.resize(bodies);
  ordered_.resize(static_cast<Eigen::Index>(6 * bodies));
}

void BlockCholesky::order(std::span<const BlockPair> pairs) {
  const auto count = static_cast<int>(bodies_);
  std::vector<Eigen::Triplet<double, int>> ones;
  for (int i = 0; i < count; ++i) ones.emplace_back(i, i, 1);
  for (const auto [a, b] : pairs) {
    ones.emplace_back(a, b, 1);
    ones.emplace_back(b, a, 1);
  }
  Eigen::SparseMatrix<double> graph(count, count);
  graph.setFromTriplets(ones.begin(), ones.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> body_of;
  Eigen::AMDOrdering<int>()(graph, body_of);
  position_.resize(bodies_);
  body_.resize(bodies_);
  for (int i = 0; i < count; ++i) {
    body_[index(i)] = body_of.indices()[i];
    position_[index(body_[index(i)])] = i;
  }
}

/// The rows of a column of L: those of the matrix, and those of the columns whose first row this
/// is.
void BlockCholesky::find_columns(std::span<const BlockPair> pairs) {
  std::vector<std::vector<std::int32_t>> rows(bodies_);
  for (const auto [a, b] : pairs) {
    const auto [low, high] = std::minmax(position_[index(a)], position_[index(b)]);
    rows[index(low)].push_back(high);
  }
  first_.assign(1, 0);
  row_.clear();
  for (std::size_t j = 0; j < bodies_; ++j) {
    std::vector<std::int32_t>& own = rows[j];
    std::ranges::sort(own);
    own.erase(std::unique(own.begin(), own.end()), own.end());
    row_.insert(row_.end(), own.begin(), own.end());
    first_.push_back(row_.size());
    if (own.size() > 1) {
      std::vector<std::int32_t>& parent = rows[index(own.front())];
      parent.insert(parent.end(), own.begin() + 1, own.end());
    }
    own = {};
  }
  places_.clear();
  for (const auto [a, b] : pairs) {
    const std::int32_t pa = position_[index(a)], pb = position_[index(b)];
    const auto [low, high] = std::minmax(pa, pb);
    const auto column = rows_of(index(low));
    const auto found = std::ranges::lower_bound(column, high);
    places_.push_back(
        {first_[index(low)] + static_cast<std::size_t>(found - column.begin()), pa < pb});
  }
}

void BlockCholesky::find_rows() {
  row_first_.assign(bodies_ + 1, 0);
  for (const std::int32_t row : row_) ++row_first_[index(row) + 1];
  for (std::size_t i = 0; i < bodies_; ++i) row_first_[i + 1] += row_first_[i];
  entries_.resize(row_.size());
  std::vector<std::size_t> next(row_first_);
  for (std::size_t j = 0; j < bodies_; ++j) {
    for (std::size_t k = first_[j]; k < first_[j + 1]; ++k) {
      entries_[next[index(row_[k])]++] = {static_cast<std::int32_t>(j), k};
    }
  }
  target_.resize(bodies_);
}

void BlockCholesky::set_zero() {
  for (Block& block : blocks_) block.setZero();
  for (Block& block : diagonal_) block.setZero();
}

void BlockCholesky::add(std::int32_t body, const Block& block) {
  diagonal_[index(position_[index(body)])] += block;
}

void BlockCholesky::add_pair(std::size_t k, const Block& block) {
  const Place& place = places_[k];
  if (place.is_transposed) {
    blocks_[place.block] += block.transpose();
  } else {
    blocks_[place.block] += block;
  }
}

bool BlockCholesky::factor() {
  for (std::size_t j = 0; j < bodies_; ++j) {
    for (std::size_t k = first_[j]; k < first_[j + 1]; ++k) target_[index(row_[k])] = k;
    Block& C = diagonal_[j];
    for (std::size_t e = row_first_[j]; e < row_first_[j + 1]; ++e) {
      const auto [column, at] = entries_[e];
      const Block& L_jk = blocks_[at];
      products_.assign(1, {L_jk.data(), C.data()});
      for (std::size_t k = at + 1; k < first_[index(column) + 1]; ++k) {
        products_.push_back({blocks_[k].data(), blocks_[target_[index(row_[k])]].data()});
      }
      kernels_->subtract(products_.data(), products_.size(), L_jk.data());
    }
    const Eigen::LLT<Block> llt(C);
    if (llt.info() != Eigen::Success) return false;
    const Block inverse = llt.matrixL().solve(Block::Identity());
    C = inverse;
    for (std::size_t k = first_[j]; k < first_[j + 1]; ++k) {
      const Block L = blocks_[k].lazyProduct(inverse.transpose());
      blocks_[k] = L;
    }
  }
  return true;
}

void BlockCholesky::solve(Eigen::Ref<Eigen::VectorXd> x) const {
  using Row = Eigen::Matrix<double, 6, 1>;
  const auto at = [&](std::size_t i) {
    return ordered_.segment<6>(static_cast<Eigen::Index>(6 * i));
  };
  assert(x.size() == static_cast<Eigen::Index>(6 * bodies_));
  for (std::size_t j = 0; j < bodies_; ++j) at(j) = x.segment<6>(6 * body_[j]);
  for (std::size_t j = 0; j < bodies_; ++j) {
    const Row y = diagonal_[j].lazyProduct(at(j));
    at(j) = y;
    for (std::size_t k = first_[j]; k < first_[j + 1]; ++k) {
      at(index(row_[k])) -= blocks_[k].lazyProduct(y);
    }
  }
  for (std::size_t j = bodies_; j-- > 0;) {
    Row y = at(j);
    for (std::size_t k = first_[j]; k < first_[j + 1]; ++k) {
      y -= blocks_[k].transpose().lazyProduct(at(index(row_[k])));
    }
    at(j) = diagonal_[j].transpose().lazyProduct(y);
  }
  for (std::size_t j = 0; j < bodies_; ++j) x.segment<6>(6 * body_[j]) = at(j);
}

}  // namespace cradle
