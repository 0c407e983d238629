/// The islands of a tick: its moving bodies, by the constraints between them.
#pragma once

#include "server/dynamics/contact/contact_solver.h"
#include "server/dynamics/contact/islands.h"

namespace cradle {

/// Bodies go by their number among those that move. Keeps its memory from tick to tick.
class TickIslands : public Islands {
 public:
  /// `slots`: how many there are.
  void find(const ContactTick& tick, std::size_t slots,
            std::span<ContactConstraint* const> constraints);

  /// By slot; -1: does not yield.
  std::span<const std::int32_t> numbers() const { return number_; }
  /// By number; -1: does not yield.
  ColouredPair bodies_of_constraint(std::size_t k) const { return pairs_[k]; }
  std::size_t of_constraint(std::size_t k) const {
    return static_cast<std::size_t>(island_of_constraint_[k]);
  }
  std::span<const std::int32_t> by_constraint() const { return island_of_constraint_; }

 private:
  std::vector<std::int32_t> number_;
  std::vector<ColouredPair> pairs_;
  std::vector<std::int32_t> island_of_constraint_;
};

}  // namespace cradle
