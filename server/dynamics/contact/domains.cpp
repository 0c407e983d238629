#include "server/dynamics/contact/domains.h"

#include <algorithm>
#include <utility>

#include "server/collision/index.h"

namespace cradle {
namespace {

std::int32_t domains_of(int bodies) {
  std::int32_t domains = 1;
  while (4 * domains * domains * Domains::kBodies <= bodies) domains *= 2;
  return domains;
}

}  // namespace

void Domains::find(std::span<const std::int32_t> slots, std::span<const std::int32_t> islands,
                   std::span<const int> sizes, std::span<const Vector> x) {
  count_ = 1;
  by_place_.clear();
  places_.clear();
  if (slots.size() < 4 * std::size_t{kBodies}) return;
  share_out(slots, islands, sizes);
  if (count_ == 1) return;
  domains_.resize(slots.size());
  points_.resize(slots.size());
  for (std::size_t k = 0; k < slots.size(); ++k) {
    const std::size_t island = index(islands[k]);
    domains_[k] = first_[island];
    points_[k] = x[index(slots[k])] - x[index(origins_[island])];
  }
  while (halve_all()) {
  }
  find_places();
}

/// Large islands first, so that the number of their domains divides that of their first one; then
/// small ones, until a domain has its bodies.
void Domains::share_out(std::span<const std::int32_t> slots, std::span<const std::int32_t> islands,
                        std::span<const int> sizes) {
  constexpr std::int32_t kNone = -1, kSeen = -2;
  first_.assign(sizes.size(), kNone);
  origins_.resize(sizes.size());
  large_.clear();
  small_.clear();
  for (std::size_t k = 0; k < islands.size(); ++k) {
    const std::int32_t island = islands[k];
    if (std::exchange(first_[index(island)], kSeen) == kSeen) continue;
    origins_[index(island)] = slots[k];
    (domains_of(sizes[index(island)]) > 1 ? large_ : small_).push_back(island);
  }
  std::ranges::sort(large_, {}, [&](std::int32_t island) {
    return std::pair(-domains_of(sizes[index(island)]), island);
  });
  subtrees_.clear();
  for (const std::int32_t island : large_) {
    first_[index(island)] = static_cast<std::int32_t>(subtrees_.size());
    const std::int32_t domains = domains_of(sizes[index(island)]);
    subtrees_.resize(subtrees_.size() + index(domains));
    subtrees_[index(first_[index(island)])].domains = domains;
  }
  int room = 0;
  for (const std::int32_t island : small_) {
    if (room <= 0) {
      room = kBodies;
      subtrees_.emplace_back().domains = 1;
    }
    first_[index(island)] = static_cast<std::int32_t>(subtrees_.size()) - 1;
    room -= sizes[index(island)];
  }
  count_ = subtrees_.size();
}

/// Those subtrees that are no domains yet. False: there were none.
bool Domains::halve_all() {
  bool is_any_left = false;
  for (std::size_t k = 0; k < domains_.size(); ++k) {
    Subtree& all = subtrees_[index(domains_[k])];
    if (all.domains == 1) continue;
    is_any_left = true;
    ++all.bodies;
    all.sum += points_[k];
    all.squares += points_[k].cwiseAbs2();
  }
  if (!is_any_left) return false;
  for (Subtree& all : subtrees_) {
    if (all.domains <= 1) continue;
    const Vector mean = all.sum / all.bodies;
    (all.squares - all.sum.cwiseProduct(mean)).maxCoeff(&all.axis);
    all.middle = mean[all.axis];
  }
  for (std::size_t k = 0; k < domains_.size(); ++k) {
    const Subtree& all = subtrees_[index(domains_[k])];
    if (all.domains > 1 && points_[k][all.axis] >= all.middle) domains_[k] += all.domains / 2;
  }
  for (std::size_t first = 0; first < subtrees_.size();) {
    const std::int32_t domains = subtrees_[first].domains, half = domains / 2;
    if (domains > 1) subtrees_[first] = subtrees_[first + index(half)] = {half};
    first += index(domains);
  }
  return true;
}

/// By counting.
void Domains::find_places() {
  begins_.assign(count_ + 1, 0);
  for (const std::int32_t domain : domains_) ++begins_[index(domain) + 1];
  for (std::size_t k = 0; k < count_; ++k) begins_[k + 1] += begins_[k];
  places_.resize(domains_.size());
  by_place_.resize(domains_.size());
  for (std::size_t k = 0; k < domains_.size(); ++k) {
    places_[k] = begins_[index(domains_[k])]++;
    by_place_[index(places_[k])] = domains_[k];
  }
}

}  // namespace cradle
