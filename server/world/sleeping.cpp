#include "server/world/sleeping.h"

#include <algorithm>
#include <cmath>

#include "server/collision/index.h"
#include "server/collision/manifolds.h"
#include "server/dynamics/contact/islands.h"
#include "server/world/edit.h"
#include "server/world/state.h"

namespace cradle {
namespace {

bool is_before(const CachedForce& p, const CachedForce& q) {
  return p.a != q.a ? p.a < q.a : p.b < q.b;
}

std::int64_t island_of(const World::State& s, std::int64_t id) {
  return s.bodies.island[*s.bodies.slot({id})];
}

bool has_velocity(const BodyTable& bodies, std::size_t i) {
  return !bodies.v[i].isZero(0) || !bodies.w[i].isZero(0);
}

/// Wakes these islands (ascending). `tick`: the first whose state shows it.
void wake(World::State& s, const std::vector<std::int64_t>& islands, Tick tick) {
  const auto is_among = [&](std::int64_t island) {
    return std::binary_search(islands.begin(), islands.end(), island);
  };
  const std::span<CachedForce> awake = s.contacts.entries();
  std::vector<CachedForce> forces(awake.begin(), awake.end());
  for (const SleepingContact& contact : s.sleepers.contacts) {
    if (is_among(contact.island)) forces.push_back(contact.force);
  }
  std::stable_sort(forces.begin(), forces.end(), is_before);
  s.contacts.set(forces);
  std::erase_if(s.sleepers.contacts, [&](const SleepingContact& c) { return is_among(c.island); });

  std::vector<std::int64_t> woken;
  for (std::size_t i = 0; i < s.bodies.size(); ++i) {
    if (!s.bodies.is_asleep(i) || !is_among(s.bodies.island[i])) continue;
    woken.push_back(s.bodies.id[i]);
    s.bodies.island[i] = 0;
    s.bodies.still[i] = 0;
    if (i < s.loads.course.size()) s.loads.course[i] = Course::falls;
    if (i < s.sleepers.is_box_known.size()) s.sleepers.is_box_known[i] = 0;
    s.events.push_back(event_of(s, i, EventKind::woke));
    s.events.back().tick = tick;
  }
  s.memory.take_up(woken);
  s.sleepers.are_slots_known = false;
}

/// m/s^2, that may bring it nearer.
double acceleration_of(const World::State& s, std::size_t i) {
  const Course course = s.loads.course[i];
  if (course == Course::pushed) return s.loads.acceleration[i].norm();
  return course == Course::falls ? s.gravity_W.norm() : 0;
}

/// Whether two bodies that move as they do have pressed on each other before the tick ends.
class Strike {
 public:
  Strike(World::State& s, const BodyPair& pair) : s_(s), a_(index(pair.a)), b_(index(pair.b)) {}

  bool will_carry(const BodyPair& pair) {
    if (s_.fast.is_fast[a_] != 0 || s_.fast.is_fast[b_] != 0) return is_hit_expected(s_, pair);
    const double margin = s_.margin(pair);
    if (!s_.is_composite(pair)) {
      return will_carry(s_.methods().collide(s_.collider(a_), s_.collider(b_), margin));
    }
    std::vector<Manifold> manifolds;
    add_manifolds(s_.collider(a_), s_.collider(b_), margin, manifolds, s_.methods());
    return std::ranges::any_of(manifolds, [this](const Manifold& m) { return will_carry(m); });
  }

 private:
  bool will_carry(const Manifold& manifold) const {
    const double fall = 0.5 * s_.dt * s_.dt * (acceleration_of(s_, a_) + acceleration_of(s_, b_));
    for (int k = 0; k < manifold.count; ++k) {
      const ContactPoint& p = manifold.points[static_cast<std::size_t>(k)];
      const Vector v = velocity(b_, p.p_W) - velocity(a_, p.p_W);
      if (p.separation <= fall - s_.dt * manifold.normal_W.dot(v)) return true;
    }
    return false;
  }

  Vector velocity(std::size_t i, const Vector& p_W) const {
    return s_.bodies.v[i] + s_.bodies.w[i].cross(p_W - s_.bodies.x[i]);
  }

  World::State& s_;
  std::size_t a_, b_;
};

/// What is still, by its tick, gravity, and kSleep.
struct Stillness {
  explicit Stillness(const World::State& s) {
    ticks = std::max(kSleep.window_ticks, static_cast<int>(std::ceil(kSleep.window_s / s.dt)));
    const double gravity = s.gravity_W.norm();
    const double window = ticks * s.dt;
    way_m = 0.5 * kSleep.acceleration * gravity * window * window;
    speed_mps = kSleep.noise * gravity * s.dt;
    drag_per_s = 1 / window;
  }
  int ticks;
  double way_m, speed_mps, drag_per_s;
};

/// Of its points at most, m.
double way_from_anchor(const World::State& s, std::size_t i) {
  const double turn = 2 * (s.bodies.still_q[i].conjugate() * s.bodies.q[i]).vec().norm();
  return (s.bodies.x[i] - s.bodies.still_x[i]).norm() + s.fast.limits[i].reach * turn;
}

/// It takes so little time to bring the body to the speed at which it balances what pushes it, that
/// this speed may be below anything that is noticed.
bool is_held_by_drag(const World::State& s, std::size_t i, const Stillness& still) {
  const Drag& drag = s.bodies.drag[i];
  const double slow_mps = still.way_m * still.drag_per_s;
  return (drag.linear + drag.quadratic * slow_mps) * s.bodies.inverse_mass[i] > still.drag_per_s ||
         drag.angular * s.bodies.inverse_inertia[i].maxCoeff() > still.drag_per_s;
}

/// True if somebody has been still for long enough.
bool count_still(World::State& s, const Stillness& still) {
  BodyTable& b = s.bodies;
  for (std::size_t i = 0; i < b.size(); ++i) {
    if (b.kind[i] != BodyKind::dynamic) {
      b.still[i] = 1;
    } else if (s.loads.course[i] != Course::touches) {
      b.still[i] = 0;
    }
  }
  for (const std::int32_t slot : s.loads.pushed) b.still[index(slot)] = 0;
  for (const std::int32_t slot : s.dragged) {
    if (is_held_by_drag(s, index(slot), still)) b.still[index(slot)] = 0;
  }
  bool any = false;
  for (const std::int32_t slot : s.moving) {
    const std::size_t i = index(slot);
    if (s.loads.course[i] != Course::touches) continue;  // in quarantine
    const bool is_sprung = !s.is_sprung.empty() && s.is_sprung[i] != 0;
    const double speed = b.v[i].norm() + s.fast.limits[i].reach * b.w[i].norm();
    if (b.still[i] == 0 || is_sprung || speed > still.speed_mps ||
        way_from_anchor(s, i) > still.way_m) {
      b.still[i] = 0;
      b.still_x[i] = b.x[i];
      b.still_q[i] = b.q[i];
    }
    any = ++b.still[i] > still.ticks || any;
  }
  return any;
}

/// The islands of a tick's end, and which of them may sleep.
class Rest {
 public:
  Rest(World::State& s, const Stillness& still) : s_(s), still_(still) {}

  void find() {
    number_.assign(s_.bodies.size(), -1);
    for (std::size_t k = 0; k < s_.moving.size(); ++k) {
      number_[index(s_.moving[k])] = static_cast<std::int32_t>(k);
    }
    carrying_.clear();
    for (const ContactConstraint* c : s_.constraints) {
      if (carries(*c)) carrying_.push_back({number_[index(c->a)], number_[index(c->b)]});
    }
    islands_.find(carrying_, s_.moving.size());
    names_.assign(islands_.count(), 0);
    is_bound_.assign(s_.moving.size(), 0);
    for (const ContactConstraint* c : s_.constraints) {
      if (carries(*c)) bind(c->a, c->b);
    }
    for (std::size_t k = 0; k < s_.moving.size(); ++k) {
      const std::size_t i = index(s_.moving[k]);
      std::int64_t& name = names_[islands_.of(static_cast<std::int32_t>(k))];
      if (name == 0) name = s_.bodies.id[i];
      if (is_bound_[k] == 0 || s_.bodies.still[i] <= still_.ticks) name = kAwake;
    }
  }

  /// Falls asleep; true if anybody does.
  bool apply() {
    bool any = false;
    for (std::size_t k = 0; k < s_.moving.size(); ++k) {
      const std::int64_t name = names_[islands_.of(static_cast<std::int32_t>(k))];
      if (name == kAwake) continue;
      any = true;
      const std::size_t i = index(s_.moving[k]);
      const Momentum before = momentum_before(s_, i);
      s_.bodies.island[i] = name;
      s_.bodies.v[i] = s_.bodies.w[i] = Vector::Zero();
      s_.sleepers.is_box_known[i] = 0;
      s_.events.push_back(event_of(s_, i, EventKind::slept));
      add_unaccounted(s_, i, s_.bodies.x[i], before);
    }
    return any;
  }

 private:
  static constexpr std::int64_t kAwake = -1;

  /// Presses, or would after the fall of one tick.
  bool carries(const ContactConstraint& c) const {
    const double fall = s_.dt * (0.5 * s_.dt * s_.gravity_W.norm() + still_.speed_mps);
    return std::ranges::any_of(
        c.used(), [&](const ConstraintPoint& p) { return p.force > 0 || p.s0 <= fall; });
  }

  /// Whoever touches what moves otherwise stays awake, and with it its island.
  void bind(std::int32_t a, std::int32_t b) {
    for (const auto& [one, other] : {std::pair(a, b), std::pair(b, a)}) {
      const std::int32_t k = number_[index(one)];
      if (k < 0) continue;
      is_bound_[index(k)] = 1;
      const std::size_t i = index(other);
      const bool is_driven = s_.bodies.kind[i] == BodyKind::kinematic && has_velocity(s_.bodies, i);
      if (is_driven || s_.bodies.quarantined[i] != 0) names_[islands_.of(k)] = kAwake;
    }
  }

  World::State& s_;
  const Stillness& still_;
  Islands& islands_ = s_.sleepers.islands;
  std::vector<ColouredPair>& carrying_ = s_.sleepers.carrying;
  std::vector<std::int32_t>& number_ = s_.sleepers.number;
  std::vector<std::int64_t>& names_ = s_.sleepers.names;
  std::vector<std::uint8_t>& is_bound_ = s_.sleepers.is_bound;
};

/// Puts by what the contacts of new sleepers carried, and their manifolds.
void put_by(World::State& s) {
  const auto is_awake = [&](std::int64_t id) {
    const std::size_t i = *s.bodies.slot({id});
    return s.bodies.is_moving(i) && !s.bodies.is_asleep(i);
  };
  const auto sleeps = [&](std::int64_t a, std::int64_t b) {
    const std::int64_t island = std::max(island_of(s, a), island_of(s, b));
    return island != 0 && !is_awake(a) && !is_awake(b) ? island : 0;
  };
  for (const CachedForce& force : s.contacts.entries()) {
    const std::int64_t island = sleeps(force.a, force.b);
    if (island != 0) s.sleepers.contacts.push_back({island, force});
  }
  s.contacts.forget_if([&](const CachedForce& f) { return sleeps(f.a, f.b) != 0; });
  s.memory.put_by([&](std::int64_t a, std::int64_t b) { return sleeps(a, b) != 0; });
  s.sleepers.are_slots_known = false;
}

}  // namespace

bool moves_for_pairs(const World::State& s, std::size_t i) {
  const BodyTable& bodies = s.bodies;
  if (bodies.kind[i] == BodyKind::dynamic) return bodies.is_moving(i) && !bodies.is_asleep(i);
  return s.sleepers.any() && (bodies.still[i] == 0 || has_velocity(bodies, i));
}

bool wake_struck(World::State& s) {
  if (!s.sleepers.any()) return false;
  std::vector<std::int64_t> struck;
  for (const BodyPair& pair : s.pairs) {
    const std::int64_t island =
        std::max(s.bodies.island[index(pair.a)], s.bodies.island[index(pair.b)]);
    if (island != 0 && Strike(s, pair).will_carry(pair)) struck.push_back(island);
  }
  if (struck.empty()) {
    std::erase_if(s.pairs, [&](const BodyPair& pair) {
      const std::size_t a = index(pair.a), b = index(pair.b);
      return s.bodies.is_asleep(a) || s.bodies.is_asleep(b) ||
             (s.bodies.kind[a] != BodyKind::dynamic && s.bodies.kind[b] != BodyKind::dynamic);
    });
    return false;
  }
  std::sort(struck.begin(), struck.end());
  wake(s, struck, s.tick);
  return true;
}

void let_sleep(World::State& s) {
  if (!s.settings.is_sleeping) return;
  const Stillness still(s);
  if (!count_still(s, still)) return;
  Rest rest(s, still);
  rest.find();
  if (rest.apply()) put_by(s);
}

void forget_slots_of_sleepers(World::State& s) {
  s.sleepers.is_box_known.assign(s.bodies.size(), 0);
  s.sleepers.are_slots_known = false;
}

void mark_sleepers_in_contact(World::State& s) {
  std::vector<std::int32_t>& slots = s.sleepers.slots;
  if (!s.sleepers.are_slots_known) {
    slots.clear();
    for (const SleepingContact& contact : s.sleepers.contacts) {
      for (const std::int64_t id : {contact.force.a, contact.force.b}) {
        slots.push_back(static_cast<std::int32_t>(*s.bodies.slot({id})));
      }
    }
    std::sort(slots.begin(), slots.end());
    slots.erase(std::unique(slots.begin(), slots.end()), slots.end());
    s.sleepers.are_slots_known = true;
  }
  for (const std::int32_t slot : slots) s.bodies.in_contact[index(slot)] = 1;
}

std::int64_t count_sleepers(const World::State& s) {
  if (!s.sleepers.any()) return 0;
  return std::ranges::count_if(s.bodies.island, [](std::int64_t island) { return island != 0; });
}

void wake_for_command(World::State& s, std::span<const std::int64_t> ids) {
  for (const std::int64_t id : ids) s.bodies.still[*s.bodies.slot({id})] = 0;
  if (!s.sleepers.any()) return;
  std::vector<std::int64_t> islands;
  for (const std::int64_t id : ids) {
    if (const std::int64_t island = island_of(s, id)) islands.push_back(island);
  }
  const auto is_among = [&](std::int64_t id) {
    return std::binary_search(ids.begin(), ids.end(), id);
  };
  for (const SleepingContact& contact : s.sleepers.contacts) {
    if (is_among(contact.force.a) || is_among(contact.force.b)) islands.push_back(contact.island);
  }
  if (islands.empty()) return;
  std::sort(islands.begin(), islands.end());
  wake(s, islands, s.tick + 1);
}

void wake_all(World::State& s) {
  std::vector<std::int64_t> islands;
  for (const SleepingContact& contact : s.sleepers.contacts) islands.push_back(contact.island);
  if (islands.empty()) return;
  std::sort(islands.begin(), islands.end());
  islands.erase(std::unique(islands.begin(), islands.end()), islands.end());
  wake(s, islands, s.tick + 1);
}

}  // namespace cradle
