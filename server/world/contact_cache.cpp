#include "server/world/contact_cache.h"

#include <algorithm>
#include <utility>

namespace cradle {

void ContactCache::Reader::restore(ContactConstraint& c) {
  const auto pair =
      std::pair(ids_[static_cast<std::size_t>(c.a)], ids_[static_cast<std::size_t>(c.b)]);
  while (entry_ != end_ && std::pair(entry_->a, entry_->b) < pair) ++entry_;
  for (auto e = entry_; e != end_ && std::pair(e->a, e->b) == pair; ++e) {
    if (e->part != c.part) continue;
    c.is_known = true;
    if (e->feature == kTurningFeature) c.torque = e->friction;
    for (ConstraintPoint& p : c.used()) {
      if (p.feature != e->feature) continue;
      p.force = e->force;
      p.press = e->press;
      p.force_t = {c.t1.dot(e->friction), c.t2.dot(e->friction)};
    }
  }
}

void ContactCache::store(std::span<const std::int64_t> ids,
                         std::span<const ContactConstraint> constraints) {
  entries_.clear();
  for (const ContactConstraint& c : constraints) {
    for (const ConstraintPoint& p : c.used()) {
      entries_.push_back({ids[static_cast<std::size_t>(c.a)], ids[static_cast<std::size_t>(c.b)],
                          c.part, p.feature, p.force, p.press,
                          p.force_t.x() * c.t1 + p.force_t.y() * c.t2});
    }
    if (c.turns_heavily()) {
      entries_.push_back({ids[static_cast<std::size_t>(c.a)], ids[static_cast<std::size_t>(c.b)],
                          c.part, kTurningFeature, 0, 0, c.torque});
    }
  }
}

void ContactCache::forget(std::span<const std::int64_t> ids) {
  const auto is_among = [&](std::int64_t id) {
    return std::binary_search(ids.begin(), ids.end(), id);
  };
  std::erase_if(entries_, [&](const CachedForce& e) { return is_among(e.a) || is_among(e.b); });
}

}  // namespace cradle
