#include "server/dynamics/contact/tick_islands.h"

#include "server/collision/index.h"

namespace cradle {
namespace {

/// Worth a thread: constraints to look at, of some nanoseconds each; and to tell the island of, and
/// bodies, of less.
constexpr int kLooks = 128, kNumbers = 1024;

}  // namespace

void TickIslands::find(const ContactTick& tick, std::size_t slots,
                       std::span<ContactConstraint* const> constraints) {
  number_.assign(slots, -1);
  for_each_index(*tick.executor, tick.moving.size(), kNumbers, [&](std::size_t k) {
    number_[index(tick.moving[k])] = static_cast<std::int32_t>(k);
  });
  pairs_.resize(constraints.size());
  for_each_index(*tick.executor, constraints.size(), kLooks, [&](std::size_t k) {
    expect_next(constraints, k);
    const ContactConstraint& c = *constraints[k];
    pairs_[k] = {number_[index(c.a)], number_[index(c.b)]};
  });
  Islands::find(pairs_, tick.moving.size());
  island_of_constraint_.resize(pairs_.size());
  for_each_index(*tick.executor, pairs_.size(), kNumbers, [&](std::size_t k) {
    const auto [a, b] = pairs_[k];
    island_of_constraint_[k] = static_cast<std::int32_t>(of(a >= 0 ? a : b));
  });
}

void TickIslands::take(Executor& executor, const TickIslands& all,
                       std::span<const std::uint8_t> are_taken,
                       std::span<const std::int32_t> moving,
                       std::span<ContactConstraint* const> constraints,
                       std::vector<std::int32_t>& taken_moving,
                       std::vector<ContactConstraint*>& taken_constraints) {
  taken_moving.resize(Islands::take(all, are_taken, renumbered_));
  number_.assign(all.number_.size(), -1);
  for_each_index(executor, moving.size(), kNumbers, [&](std::size_t k) {
    const std::int32_t number = renumbered_[k];
    if (number < 0) return;
    number_[index(moving[k])] = number;
    taken_moving[index(number)] = moving[k];
  });
  is_taken_.resize(constraints.size());
  const auto count = [&](std::size_t begin, std::size_t end) {
    std::size_t taken = 0;
    for (std::size_t k = begin; k < end; ++k) {
      is_taken_[k] = are_taken[all.of_constraint(k)];
      taken += is_taken_[k];
    }
    return taken;
  };
  const auto make_room = [&](std::size_t taken) {
    pairs_.resize(taken);
    island_of_constraint_.resize(taken);
    taken_constraints.resize(taken);
  };
  const auto number_here = [this](std::int32_t k) { return k < 0 ? -1 : renumbered_[index(k)]; };
  const auto write = [&](std::size_t begin, std::size_t end, std::size_t to) {
    for_marked(is_taken_, begin, end, [&](std::size_t k) {
      pairs_[to] = {number_here(all.pairs_[k].a), number_here(all.pairs_[k].b)};
      island_of_constraint_[to] = taken_as(all.of_constraint(k));
      taken_constraints[to++] = constraints[k];
    });
  };
  in_order_.list(executor, constraints.size(), count, make_room, write);
}

}  // namespace cradle
