#include "server/dynamics/contact/tick_islands.h"

namespace cradle {
namespace {

/// Worth a thread: constraints to look at, of some nanoseconds each; and to tell the island of, of
/// less.
constexpr int kLooks = 128, kIslands = 1024;

}  // namespace

void TickIslands::find(const ContactTick& tick, std::size_t slots,
                       std::span<ContactConstraint* const> constraints) {
  number_.assign(slots, -1);
  for (std::size_t k = 0; k < tick.moving.size(); ++k) {
    number_[static_cast<std::size_t>(tick.moving[k])] = static_cast<std::int32_t>(k);
  }
  pairs_.resize(constraints.size());
  for_each_index(*tick.executor, constraints.size(), kLooks, [&](std::size_t k) {
    expect_next(constraints, k);
    const ContactConstraint& c = *constraints[k];
    pairs_[k] = {number_[static_cast<std::size_t>(c.a)], number_[static_cast<std::size_t>(c.b)]};
  });
  Islands::find(pairs_, tick.moving.size());
  find_constraints(*tick.executor);
}

void TickIslands::take(Executor& executor, const TickIslands& all,
                       std::span<const std::uint8_t> are_taken,
                       std::span<const std::int32_t> moving,
                       std::span<ContactConstraint* const> constraints,
                       std::vector<std::int32_t>& taken_moving,
                       std::vector<ContactConstraint*>& taken_constraints) {
  Islands::take(all, are_taken, renumbered_);
  const auto number_here = [this](std::int32_t k) {
    return k < 0 ? -1 : renumbered_[static_cast<std::size_t>(k)];
  };
  number_.assign(all.number_.size(), -1);
  taken_moving.clear();
  for (std::size_t k = 0; k < moving.size(); ++k) {
    if (renumbered_[k] < 0) continue;
    number_[static_cast<std::size_t>(moving[k])] = renumbered_[k];
    taken_moving.push_back(moving[k]);
  }
  pairs_.clear();
  taken_constraints.clear();
  for (std::size_t k = 0; k < constraints.size(); ++k) {
    if (are_taken[all.of_constraint(k)] == 0) continue;
    pairs_.push_back({number_here(all.pairs_[k].a), number_here(all.pairs_[k].b)});
    taken_constraints.push_back(constraints[k]);
  }
  find_constraints(executor);
}

void TickIslands::find_constraints(Executor& executor) {
  island_of_constraint_.resize(pairs_.size());
  for_each_index(executor, pairs_.size(), kIslands, [&](std::size_t k) {
    const auto [a, b] = pairs_[k];
    island_of_constraint_[k] = static_cast<std::int32_t>(of(a >= 0 ? a : b));
  });
}

}  // namespace cradle
