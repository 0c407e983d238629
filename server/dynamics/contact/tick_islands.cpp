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

}  // namespace cradle
