/// Manifolds that a batch has made, to compare with those of pairs alone.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "server/collision/manifold.h"

namespace cradle {

class InOrder final : public MadeManifolds {
 public:
  explicit InOrder(std::size_t count) : made(count) {}
  Manifold& room(std::size_t key) override { return made[key]; }
  void take(std::size_t key, const Manifold& manifold) override { made[key] = manifold; }
  std::vector<Manifold> made;
};

/// To the bit.
inline bool are_the_same(const Manifold& one, const Manifold& other) {
  const auto is_same_point = [](const ContactPoint& p, const ContactPoint& q) {
    return p.p_W == q.p_W && p.separation == q.separation && p.feature == q.feature;
  };
  const bool is_same_lead =
      one.lead == other.lead || (std::isnan(one.lead) && std::isnan(other.lead));
  return one.count == other.count && is_same_lead &&
         (one.count == 0 || one.normal_W == other.normal_W) &&
         std::equal(one.points.begin(), one.points.begin() + one.count, other.points.begin(),
                    is_same_point);
}

}  // namespace cradle
