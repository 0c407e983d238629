// Groups are the connected parts of the graph of dynamic bodies and springs, in the order of their
// first bodies; bodies and springs in a group are in the order of the world.
//
// A kinematic end goes straight from where it is to where it will be at the tick's end.
#include "server/world/springs.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>

#include "server/dynamics/rotation.h"
#include "server/world/plane.h"
#include "server/world/quarantine.h"

namespace cradle {
namespace {

/// Union-find over slots; the representative is the lowest slot.
class Groups {
 public:
  explicit Groups(std::size_t size) : parents_(size) {
    std::iota(parents_.begin(), parents_.end(), std::size_t{0});
  }
  std::size_t find(std::size_t i) {
    while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
    return i;
  }
  void join(std::size_t a, std::size_t b) {
    a = find(a);
    b = find(b);
    parents_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::size_t> parents_;
};

/// A spring with its bodies' slots; no slot: the world.
struct Joined {
  const Spring* spring;
  std::optional<std::size_t> a, b;
};

std::vector<Joined> active_springs(const World::State& s) {
  std::vector<Joined> joined;
  for (const Spring& spring : s.springs) {
    Joined one{&spring, s.bodies.slot(spring.a), {}};
    if (spring.b) one.b = s.bodies.slot(spring.b);
    const bool rests =
        s.bodies.quarantined[*one.a] != 0 || (one.b && s.bodies.quarantined[*one.b] != 0);
    if (!rests) joined.push_back(one);
  }
  return joined;
}

/// A point given from Bo in B, as one from Bcm in P.
Vector point_in_P(const BodyTable& bodies, std::size_t i, const Vec3& point) {
  return bodies.q_BP[i].conjugate() * (to_eigen(point) - bodies.p_BoBcm[i]);
}

/// Where a point of a body that nothing pushes is after `dt`.
Vector driven_point(const BodyTable& bodies, std::size_t i, const Vec3& point, double dt) {
  const Vector arm = bodies.q[i] * point_in_P(bodies, i, point);
  return bodies.x[i] + dt * bodies.v[i] + rotation_exp(dt * bodies.w[i]) * arm;
}

class Group {
 public:
  explicit Group(World::State& s) : s_(s) {}

  bool empty() const { return links_.empty(); }

  void add_body(std::size_t i) {
    const BodyTable& b = s_.bodies;
    if (s_.loads.course[i] == Course::falls) s_.loads.set_to_gravity(i, s_.gravity_W);
    places_[i] = static_cast<std::int32_t>(slots_.size());
    slots_.push_back(i);
    SpringBody& body = bodies_.emplace_back();
    body.flight = {b.x[i], b.q[i], b.v[i], b.w[i]};
    body.inertia = {b.mass[i], b.inertia[i]};
    body.force_W = b.mass[i] * s_.loads.acceleration[i];
    body.torque_W = s_.loads.torque_W[i];
    body.torque_B = s_.loads.torque_P[i];
    body.drag = b.drag[i];
  }

  void add_spring(const Joined& joined) {
    const Spring& spring = *joined.spring;
    SpringLink& link = links_.emplace_back();
    link.a = end(joined.a, spring.point_a);
    link.b = end(joined.b, spring.point_b);
    link.stiffness = spring.stiffness;
    link.damping = spring.damping;
    link.rest_length = spring.rest_length;
  }

  void step() {
    const SpringReport report = spring_step(bodies_, links_, s_.dt);
    s_.springs_unconverged += report.unconverged;
    for (std::size_t k = 0; k < slots_.size(); ++k) give_back(slots_[k], bodies_[k]);
  }

 private:
  SpringEnd end(const std::optional<std::size_t>& slot, const Vec3& at) const {
    const BodyTable& bodies = s_.bodies;
    if (!slot) return {-1, to_eigen(at), to_eigen(at)};
    if (bodies.kind[*slot] == BodyKind::dynamic) {
      return {places_.at(*slot), point_in_P(bodies, *slot, at), Vector::Zero()};
    }
    return {-1, driven_point(bodies, *slot, at, 0), driven_point(bodies, *slot, at, s_.dt)};
  }

  void give_back(std::size_t i, const SpringBody& body) {
    BodyTable& b = s_.bodies;
    Flight end = body.flight;
    if (s_.settings.is_planar) keep_in_plane(end);
    if (s_.loads.course[i] != Course::touches) return end_tick(s_, i, end);
    // The mean force includes drag.
    s_.loads.acceleration[i] = (end.v - b.v[i]) / s_.dt;
    if (!body.inertia.turns()) return;
    const auto momentum = [&](const Rotation& q, const Vector& w) {
      return Vector(q * b.inertia[i].cwiseProduct(q.conjugate() * w));
    };
    s_.loads.torque_W[i] = (momentum(end.q, end.w) - momentum(b.q[i], b.w[i])) / s_.dt;
  }

  World::State& s_;
  std::map<std::size_t, std::int32_t> places_;
  std::vector<std::size_t> slots_;
  std::vector<SpringBody> bodies_;
  std::vector<SpringLink> links_;
};

}  // namespace

void move_with_springs(World::State& s) {
  s.is_sprung.clear();
  s.springs_unconverged = 0;
  const std::vector<Joined> springs = active_springs(s);
  if (springs.empty()) return;
  s.is_sprung.assign(s.bodies.size(), 0);
  const auto is_dynamic = [&](const std::optional<std::size_t>& slot) {
    return slot && s.bodies.kind[*slot] == BodyKind::dynamic;
  };
  Groups groups(s.bodies.size());
  for (const Joined& joined : springs) {
    for (const auto& slot : {joined.a, joined.b}) {
      if (is_dynamic(slot)) s.is_sprung[*slot] = 1;
    }
    if (is_dynamic(joined.a) && is_dynamic(joined.b)) groups.join(*joined.a, *joined.b);
  }
  std::map<std::size_t, Group> by_first;
  for (std::size_t i = 0; i < s.bodies.size(); ++i) {
    if (s.is_sprung[i] != 0) by_first.try_emplace(groups.find(i), s).first->second.add_body(i);
  }
  for (const Joined& joined : springs) {
    const std::size_t one = is_dynamic(joined.a) ? *joined.a : *joined.b;
    by_first.at(groups.find(one)).add_spring(joined);
  }
  for (auto& [first, group] : by_first) group.step();
}

double energy_of_springs(const World::State& s) {
  double energy_J = 0;
  for (const Joined& joined : active_springs(s)) {
    const Spring& spring = *joined.spring;
    const auto place = [&](const std::optional<std::size_t>& slot, const Vec3& point) {
      return slot ? driven_point(s.bodies, *slot, point, 0) : to_eigen(point);
    };
    const Vector d = place(joined.b, spring.point_b) - place(joined.a, spring.point_a);
    const double stretch = d.norm() - spring.rest_length;
    energy_J += spring.stiffness / 2 * stretch * stretch;
  }
  return energy_J;
}

}  // namespace cradle
