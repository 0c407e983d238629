#include "server/dynamics/contact/tick_islands.h"

namespace cradle {

void TickIslands::find(const ContactTick& tick, std::size_t slots,
                       std::span<const ContactConstraint> constraints) {
  const auto number = [this](std::int32_t slot) -> std::int32_t& {
    return number_[static_cast<std::size_t>(slot)];
  };
  number_.assign(slots, -1);
  for (std::size_t k = 0; k < tick.moving.size(); ++k) {
    number(tick.moving[k]) = static_cast<std::int32_t>(k);
  }
  pairs_.clear();
  for (const ContactConstraint& c : constraints) pairs_.push_back({number(c.a), number(c.b)});
  Islands::find(pairs_, tick.moving.size());
}

}  // namespace cradle
