#include "server/dynamics/contact/tick_islands.h"

namespace cradle {

void TickIslands::find(const ContactTick& tick, std::size_t slots,
                       std::span<ContactConstraint* const> constraints) {
  number_.assign(slots, -1);
  for (std::size_t k = 0; k < tick.moving.size(); ++k) {
    number_[static_cast<std::size_t>(tick.moving[k])] = static_cast<std::int32_t>(k);
  }
  pairs_.clear();
  for (std::size_t k = 0; k < constraints.size(); ++k) {
    expect_next(constraints, k);
    const ContactConstraint& c = *constraints[k];
    pairs_.push_back(
        {number_[static_cast<std::size_t>(c.a)], number_[static_cast<std::size_t>(c.b)]});
  }
  Islands::find(pairs_, tick.moving.size());
}

}  // namespace cradle
