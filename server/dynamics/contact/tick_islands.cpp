#include "server/dynamics/contact/tick_islands.h"

namespace cradle {

void TickIslands::begin(const ContactTick& tick, std::size_t slots) {
  number_.assign(slots, -1);
  for (std::size_t k = 0; k < tick.moving.size(); ++k) {
    number_[static_cast<std::size_t>(tick.moving[k])] = static_cast<std::int32_t>(k);
  }
  pairs_.clear();
}

void TickIslands::add(const ContactConstraint& c) {
  pairs_.push_back(
      {number_[static_cast<std::size_t>(c.a)], number_[static_cast<std::size_t>(c.b)]});
}

void TickIslands::find(const ContactTick& tick, std::size_t slots,
                       std::span<const ContactConstraint> constraints) {
  begin(tick, slots);
  for (const ContactConstraint& c : constraints) add(c);
  Islands::find(pairs_, tick.moving.size());
}

void TickIslands::find(const ContactTick& tick, std::size_t slots,
                       std::span<ContactConstraint* const> constraints) {
  begin(tick, slots);
  for (std::size_t k = 0; k < constraints.size(); ++k) {
    expect_next(constraints, k);
    add(*constraints[k]);
  }
  Islands::find(pairs_, tick.moving.size());
}

}  // namespace cradle
