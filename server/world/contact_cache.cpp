#include "server/world/contact_cache.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "server/collision/fetch.h"
#include "server/collision/in_order.h"

namespace cradle {

namespace {

/// Of the arm: points of one face are no farther from its plane.
constexpr double kInPlane = 0.05;
/// Of the force: what points may be asked to pull before they are said not to carry the same.
constexpr double kMayPull = 0.05;

/// Whether its points remember nothing but that they are not new.
bool bears_nothing(const ContactConstraint& c) {
  return std::ranges::all_of(c.used(), [&c](const ConstraintPoint& p) {
    return p.force == 0 && p.press == 0 && (!c.has_rested || c.rest(p).is_none());
  });
}

/// All that it remembers, each into the room that `add()` gives.
template <class F>
void tell(const ContactConstraint& c, const F& add) {
  const Vector t2 = c.t2();
  if (bears_nothing(c)) {
    CarriedForce& idle = add() = {};
    idle.feature = kIdleFeature;
    idle.K_normal = c.K_normals[0];
  } else {
    for (std::size_t i = 0; i < c.used().size(); ++i) {
      const ConstraintPoint& p = c.points[i];
      CarriedForce& carried = add();
      carried.feature = c.features[i];
      carried.force = p.force;
      carried.press = p.press;
      carried.K_normal = c.K_normals[i];
      carried.rest = c.has_rested ? c.rests[i] : PointRest{};
      carried.friction = p.force_t.x() * c.t1 + p.force_t.y() * t2;
      carried.arm = p.rA;
    }
  }
  if (!c.turns_heavily()) return;
  CarriedForce& turning = add() = {};
  turning.feature = kTurningFeature;
  turning.friction = c.torque;
}

/// Of its points, the one with this feature, most likely the one of this number; their number if
/// there is none.
std::size_t find(const ContactConstraint& c, std::uint64_t feature, std::size_t likely) {
  const std::size_t count = c.used().size();
  if (likely < count && c.features[likely] == feature) return likely;
  const auto begin = c.features.begin(), end = begin + c.count;
  return static_cast<std::size_t>(std::find(begin, end, feature) - begin);
}

}  // namespace

void ContactMemory::restore(ContactConstraint& c) const {
  int gone = 0, found = 0;
  const Vector t2 = c.t2();
  for (std::size_t k = 0; k < count_; ++k) {
    const CarriedForce& e = forces_[k];
    c.is_known = true;
    if (e.feature == kTurningFeature) {
      if (c.turns_heavily()) c.torque = e.friction;
      continue;
    }
    if (e.feature == kIdleFeature) {
      c.K_normals.fill(e.K_normal);
      continue;
    }
    const std::size_t i = find(c, e.feature, k);
    if (i == c.used().size()) {
      gone += e.force > 0 ? 1 : 0;
      continue;
    }
    ++found;
    ConstraintPoint& p = c.points[i];
    p.force = e.force;
    p.press = e.press;
    p.force_t = {c.t1.dot(e.friction), t2.dot(e.friction)};
    c.K_normals[i] = e.K_normal;
    if (!e.rest.is_none()) c.set_rest(p, e.rest);
  }
  if (gone > 0 && found < c.count) hand_on(c);
}

/// The least forces l_i >= 0 of the new points with  sum l_i (1, u_i, v_i) = sum of what is gone,
/// u and v in the plane of contact:  l_i = (1, u_i, v_i) . y,  sum (1, u, v)(1, u, v)^T y = that
/// sum.
void ContactMemory::hand_on(ContactConstraint& c) const {
  std::array<ConstraintPoint*, kManifoldPoints> fresh{};
  std::size_t count = 0;
  for (ConstraintPoint& p : c.used()) fresh[count++] = &p;
  Vector gone = Vector::Zero(), friction = Vector::Zero();
  const Vector origin = c.points[0].rA, t2 = c.t2();
  const auto in_plane = [&](const Vector& arm) {
    return Vector(1, c.t1.dot(arm - origin), t2.dot(arm - origin));
  };
  double press = 0;
  for (const CarriedForce& e : forces()) {
    if (e.feature == kTurningFeature) continue;
    const std::size_t i = find(c, e.feature, c.used().size());
    if (i < c.used().size()) {
      const auto last = std::remove(fresh.begin(), fresh.begin() + count, &c.points[i]);
      count = static_cast<std::size_t>(last - fresh.begin());
      continue;
    }
    if (std::abs(c.n.dot(e.arm - origin)) > kInPlane * origin.norm()) return;
    gone += e.force * in_plane(e.arm);
    friction += e.friction;
    press = std::max(press, e.press);
  }
  const std::span<ConstraintPoint*> points(fresh.data(), count);
  Matrix G = Matrix::Zero();
  for (const ConstraintPoint* p : points) G += in_plane(p->rA) * in_plane(p->rA).transpose();
  G += 1e-9 * G.trace() * Matrix::Identity();
  const Vector y = G.ldlt().solve(gone);
  double sum = 0;
  for (const ConstraintPoint* p : points) {
    const double force = y.dot(in_plane(p->rA));
    if (force < -kMayPull * gone[0]) return;
    sum += std::max(force, 0.0);
  }
  if (!(sum > 0)) return;
  for (ConstraintPoint* p : points) {
    const double share = std::max(y.dot(in_plane(p->rA)), 0.0) / sum;
    p->force = share * gone[0];
    p->force_t = share * Eigen::Vector2d(c.t1.dot(friction), t2.dot(friction));
    p->press = p->force > 0 ? press : 0;
  }
}

void ContactCache::begin() {
  std::swap(places_, last_places_);
  places_.resize(names_.size());
  from_.resize(names_.size());
  is_new_.resize(names_.size());
  were_entries_ = std::exchange(are_entries_, false);
  is_gone_.assign(last_.size(), 1);
}

/// Which of these contacts were there last tick, and where; others have no place until all settle.
/// The first may be in the middle of its pair.
void ContactCache::find(std::size_t begin, std::size_t end) {
  if (were_entries_) {
    std::ranges::fill(std::span(from_).subspan(begin, end - begin), -1);
    std::ranges::fill(std::span(is_new_).subspan(begin, end - begin), 1);
    return;
  }
  const auto pair_of = [](const ContactName& name) { return name.pair; };
  std::size_t old = static_cast<std::size_t>(
      std::ranges::lower_bound(last_, names_[begin].pair, {}, pair_of) - last_.begin());
  for (std::size_t k = begin; k < end; ++k) {
    const ContactName& name = names_[k];
    while (old < last_.size() && last_[old].pair < name.pair) ++old;
    from_[k] = -1;
    is_new_[k] = 1;
    for (std::size_t m = old; m < last_.size() && last_[m].pair == name.pair; ++m) {
      if (last_[m].part != name.part) continue;
      from_[k] = static_cast<std::int32_t>(m);
      places_[k] = last_places_[m];
      is_new_[k] = is_gone_[m] = 0;
      break;
    }
  }
}

/// Those that are new take the places of those that are gone, or new ones.
void ContactCache::settle() {
  for_all_marked(is_gone_, [this](std::size_t m) { free_.push_back(last_places_[m]); });
  for_all_marked(is_new_, [this](std::size_t k) {
    if (free_.empty()) {
      free_.push_back(static_cast<std::int32_t>(room_.size()));
      room_.emplace_back();
    }
    places_[k] = free_.back();
    free_.pop_back();
  });
}

void ContactCache::recall(std::size_t k, ContactMemory& memory) const {
  memory.clear();
  if (from_[k] >= 0) {
    tell(room_[static_cast<std::size_t>(places_[k])],
         [&memory]() -> CarriedForce& { return memory.add(); });
  }
  if (!were_entries_) return;
  const PairName& pair = names_[k].pair;
  const auto pair_of = [](const CachedForce& e) { return PairName{e.a, e.b}; };
  for (auto e = std::ranges::lower_bound(entries_, pair, {}, pair_of);
       e != entries_.end() && pair_of(*e) == pair; ++e) {
    if (e->part == names_[k].part) memory.add() = e->carried;
  }
}

void ContactCache::expect(std::size_t k) const {
  fetch(&room_[static_cast<std::size_t>(places_[k])], offsetof(ContactConstraint, rests));
}

std::span<CachedForce> ContactCache::entries() {
  if (are_entries_) return entries_;
  entries_.clear();
  for (std::size_t k = 0; k < names_.size(); ++k) {
    const ContactName& name = names_[k];
    tell((*this)[k], [&]() -> CarriedForce& {
      return entries_.emplace_back(CachedForce{name.pair.a, name.pair.b, name.part, {}}).carried;
    });
  }
  are_entries_ = true;
  return entries_;
}

void ContactCache::set(std::span<const CachedForce> entries) {
  are_entries_ = true;
  entries_.assign(entries.begin(), entries.end());
}

void ContactCache::forget(std::span<const std::int64_t> ids) {
  const auto is_among = [&](std::int64_t id) {
    return std::binary_search(ids.begin(), ids.end(), id);
  };
  forget_if([&](const CachedForce& e) { return is_among(e.a) || is_among(e.b); });
}

}  // namespace cradle
