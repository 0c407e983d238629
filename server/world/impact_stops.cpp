#include "server/world/impact_stops.h"

#include <algorithm>
#include <cmath>

#include "server/collision/box_tree.h"
#include "server/collision/in_order.h"
#include "server/collision/index.h"
#include "server/collision/pair_rules.h"
#include "server/dynamics/rotation.h"
#include "server/world/ball_pairs.h"
#include "server/world/fast_bodies.h"
#include "server/world/plane.h"
#include "server/world/state.h"

namespace cradle {
namespace {

constexpr int kSweepsMax = 16;
constexpr int kLooks = 128;  // worth a thread, of some tens of nanoseconds

using Mover = ImpactStops::Mover;
using Candidate = ImpactStops::Candidate;

class Stops {
 public:
  Stops(World::State& s, Executor& executor)
      : s_(s),
        executor_(executor),
        memory_(s.stops),
        movers_(memory_.movers),
        candidates_(memory_.candidates) {
    movers_.clear();
    candidates_.clear();
  }

  void find_and_apply() {
    list_movers();
    if (movers_.empty()) return;
    list_pairs();
    for (int sweep = 0; sweep < kSweepsMax && look_at_pairs(); ++sweep) {
    }
    keep_unresolved_at_start();
    for (const Mover& mover : movers_) {
      if (mover.path.until < 1) stop(mover);
    }
  }

 private:
  bool is_lost(std::size_t i) const { return s_.lost[i] != 0 || s_.bodies.quarantined[i] != 0; }

  bool passes_strangers(std::size_t i) const {
    return std::ranges::any_of(s_.balls.passed_by, [i](const BodyPair& pair) {
      return index(pair.a) == i || index(pair.b) == i;
    });
  }

  /// By contacts: it was not fast before.
  bool went_far(std::size_t i) const {
    if (s_.fast.is_fast[i] != 0 || is_lost(i)) return false;
    Path rough;
    rough.travel = s_.bodies.x[i] - (s_.poses[i].x + s_.poses[i].R * s_.bodies.p_BoBcm[i]);
    rough.turn = s_.dt * s_.bodies.w[i];
    return is_far(s_, i, rough);
  }

  /// What was fast when it began, and what contacts have made so.
  void list_movers() {
    FastBodies& fast = s_.fast;
    for (std::size_t m = 0; m < fast.slots.size(); ++m) {
      const std::size_t i = index(fast.slots[m]);
      if (is_lost(i) || (s_.balls.flies(i) && !passes_strangers(i))) continue;
      movers_.push_back({i, travelled(s_, i, fast.w_start[m]), s_.bodies.in_contact[i] == 0,
                         fast.v_start[m], fast.w_start[m]});
    }
    memory_.went_far.resize(s_.moving.size());
    for_each_index(executor_, s_.moving.size(), kLooks, [this](std::size_t k) {
      memory_.went_far[k] = went_far(index(s_.moving[k])) ? 1 : 0;
    });
    for_all_marked(memory_.went_far, [&](std::size_t k) {
      const std::size_t i = index(s_.moving[k]);
      fast.is_fast[i] = 1;
      fast.any = true;
      movers_.push_back({i, travelled(s_, i, s_.bodies.w[i]), false, {}, {}});
    });
    std::sort(movers_.begin(), movers_.end(),
              [](const Mover& one, const Mover& other) { return one.slot < other.slot; });
  }

  Mover* mover(std::int32_t slot) {
    const auto found =
        std::lower_bound(movers_.begin(), movers_.end(), index(slot),
                         [](const Mover& one, std::size_t i) { return one.slot < i; });
    return found != movers_.end() && found->slot == index(slot) ? &*found : nullptr;
  }

  Path path_of(std::int32_t slot) {
    const Mover* fast = mover(slot);
    return fast != nullptr ? fast->path : travelled(s_, index(slot), s_.bodies.w[index(slot)]);
  }

  /// The pairs of this tick; and those of bodies that left the boxes in which pairs were sought.
  void list_pairs() {
    const auto is_fast = [this](std::int32_t slot) { return s_.fast.is_fast[index(slot)] != 0; };
    auto touch = s_.touching.cbegin();
    for (const BodyPair& pair : s_.pairs) {
      while (touch != s_.touching.cend() && touch->pair < pair) ++touch;
      if (!is_fast(pair.a) && !is_fast(pair.b)) continue;
      const bool touches = touch != s_.touching.cend() && touch->pair == pair;
      add_pair(pair, touches ? ImpactGoal::contact : ImpactGoal::gap);
    }
    for (const BodyPair& pair : s_.balls.passed_by) add_pair(pair, ImpactGoal::gap);
    std::vector<BodyPair>& more = pairs_of_leavers();
    std::sort(more.begin(), more.end());
    more.erase(std::unique(more.begin(), more.end()), more.end());
    for (const BodyPair& pair : more) {
      if (std::binary_search(s_.pairs.begin(), s_.pairs.end(), pair)) continue;
      add_pair(pair, ImpactGoal::gap);
    }
  }

  void add_pair(const BodyPair& pair, ImpactGoal goal) {
    if (mover(pair.a) == nullptr && mover(pair.b) == nullptr) return;
    candidates_.push_back({pair, goal, path_of(pair.a), path_of(pair.b)});
  }

  std::vector<BodyPair>& pairs_of_leavers() {
    std::vector<std::size_t>& leavers = memory_.leavers;
    leavers.clear();
    if (s_.balls.are_apart) put_balls_in_boxes(s_);
    for (const Mover& one : movers_) {
      if (s_.balls.flies(one.slot)) continue;
      const auto at = std::lower_bound(s_.colliders.begin(), s_.colliders.end(),
                                       static_cast<std::int32_t>(one.slot));
      const auto k = static_cast<std::size_t>(at - s_.colliders.begin());
      const Aabb box = box_of_path(s_, one.slot, one.path);
      if (s_.boxes[k].holds(box)) continue;
      s_.boxes[k] = box;
      leavers.push_back(k);
    }
    std::vector<BodyPair>& pairs = memory_.pairs;
    pairs.clear();
    if (leavers.empty()) return pairs;
    const Vector origin = median_of(s_.boxes);
    std::vector<FloatBox> boxes(s_.boxes.size());
    std::vector<std::int32_t> slots;
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      if (!is_usable(s_.boxes[k])) continue;
      boxes[k] = to_float(s_.boxes[k], origin);
      slots.push_back(static_cast<std::int32_t>(k));
    }
    BoxTree tree;
    tree.build(boxes, slots, MortonCurve(boxes, slots));
    for (const std::size_t k : leavers) {
      const auto add = [&](std::int32_t other) {
        const std::int32_t one = s_.colliders[k], two = s_.colliders[index(other)];
        if (one != two) pairs.push_back({std::min(one, two), std::max(one, two)});
      };
      tree.query(boxes[k], add);
      for (const Plane& plane : s_.planes) {
        if (overlap(s_.boxes[k], plane)) add(plane.slot);
      }
    }
    return pairs;
  }

  /// True if a way became shorter.
  bool look_at_pairs() {
    std::vector<std::size_t>& open = memory_.open;
    open.clear();
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      if (candidates_[c].is_open) open.push_back(c);
    }
    std::vector<TimeOfImpact>& found = memory_.found;
    found.resize(open.size());
    executor_.for_ranges(static_cast<int>(open.size()), 1, [this](int begin, int end) {
      for (int k = begin; k < end; ++k) {
        const Candidate& c = candidates_[memory_.open[index(k)]];
        memory_.found[index(k)] = meet(s_, index(c.pair.a), c.A, index(c.pair.b), c.B, c.goal);
      }
    });
    std::vector<std::int32_t>& stopped = memory_.stopped;
    stopped.clear();
    for (std::size_t k = 0; k < open.size(); ++k) {
      Candidate& c = candidates_[open[k]];
      c.is_open = false;
      count(s_.fast, found[k]);
      c.time = found[k].kind == TimeOfImpact::Kind::none ? 1 : found[k].time;
      for (const std::int32_t slot : {c.pair.a, c.pair.b}) {
        Mover* one = mover(slot);
        if (one == nullptr) continue;
        const std::int32_t other = slot == c.pair.a ? c.pair.b : c.pair.a;
        const bool carries = s_.bodies.kind[index(other)] == BodyKind::kinematic && c.time < 1;
        if (c.time < one->path.until) {
          one->path.until = c.time;
          one->carrier = -1;
          one->out = (slot == c.pair.a ? -found[k].out : found[k].out) * found[k].normal_W;
          stopped.push_back(slot);
        }
        if (carries && one->carrier < 0) {  // it may come to where another has stopped it
          one->carrier = other;
          one->carried_from = c.time;
        }
      }
    }
    std::sort(stopped.begin(), stopped.end());
    for (Candidate& c : candidates_) {
      const auto follow = [&](std::int32_t slot, Path& path) {
        if (!std::binary_search(stopped.begin(), stopped.end(), slot)) return;
        path.until = mover(slot)->path.until;
        c.is_open = c.is_open || path.until < c.time;  // at its own hit there is nothing to learn
      };
      follow(c.pair.a, c.A);
      follow(c.pair.b, c.B);
    }
    return !stopped.empty();
  }

  void keep_unresolved_at_start() {
    for (const Candidate& c : candidates_) {
      if (!c.is_open) continue;
      for (const std::int32_t slot : {c.pair.a, c.pair.b}) {
        Mover* one = mover(slot);
        if (one == nullptr || one->path.until == 0) continue;
        one->path.until = 0;
        one->carrier = -1;
        one->out.setZero();
        ++s_.fast.unresolved;
      }
    }
  }

  double energy_of_rotation(std::size_t i) const {
    const BodyTable& bodies = s_.bodies;
    const Vector w_P = bodies.q[i].conjugate() * bodies.w[i];
    return 0.5 * w_P.dot(bodies.inertia[i].cwiseProduct(w_P));
  }

  /// At the tick's end, if it goes along with a body from `time` on.
  Pose carried(const Pose& X, std::int32_t carrier, double time) {
    const Path path = path_of(carrier);
    const Pose then = moved(path, s_.poses[index(carrier)], time);
    const Pose now = moved(path, s_.poses[index(carrier)], 1);
    const Matrix R = now.R * then.R.transpose();
    return {now.x + R * (X.x - then.x), R * X.R};
  }

  Vector acceleration(std::size_t i) const {
    return s_.loads.course[i] == Course::falls ? s_.gravity_W : s_.loads.acceleration[i];
  }

  /// Of its motion what loads have given on a way that it did not go, `over` of the tick: their
  /// work, but no more than their impulse. What a contact braked on that way has little left of
  /// that work.
  void give_back(std::size_t i, double most_J, double over) {
    BodyTable& bodies = s_.bodies;
    const double now_J = momentum_of(s_, i).kinetic_J;
    most_J = std::max(most_J, 0.0);
    if (now_J <= most_J) return;
    const double by_work = std::sqrt(most_J / now_J);
    const double speed = bodies.v[i].norm();
    const double given = over * s_.dt * acceleration(i).norm();
    const double share = speed * (1 - by_work) > given ? 1 - given / speed : by_work;
    bodies.v[i] *= share;
    bodies.w[i] *= share;
  }

  void stop(const Mover& mover) {
    BodyTable& bodies = s_.bodies;
    const std::size_t i = mover.slot;
    const double t = mover.path.until;
    const double energy = energy_of_rotation(i);
    const Vector x_before = bodies.x[i];
    const Momentum before = momentum_before(s_, i);
    const double kinetic_J = momentum_of(s_, i).kinetic_J;
    Pose X = moved(mover.path, s_.poses[i], t);
    if (mover.carrier >= 0) X = carried(X, mover.carrier, mover.carried_from);
    X.x += mover.out;
    bodies.place(i, {X.x, normalised(Rotation(X.R))});
    ++s_.fast.stopped;
    if (mover.flew_fast) {
      bodies.v[i] = mover.v_start + t * (bodies.v[i] - mover.v_start);
      bodies.w[i] = mover.w_start + t * (bodies.w[i] - mover.w_start);
    }
    const double now = energy_of_rotation(i);
    if (now > energy && now > 0) bodies.w[i] *= std::sqrt(energy / now);
    if (mover.carrier < 0) {
      const double work_J = bodies.mass[i] * acceleration(i).dot(x_before - bodies.x[i]);
      give_back(i, kinetic_J - work_J, 1 - t);
    }
    if (s_.settings.is_planar) keep_in_plane(bodies, i);
    add_unaccounted(s_, i, x_before, before);
  }

  World::State& s_;
  Executor& executor_;
  ImpactStops& memory_;
  std::vector<Mover>& movers_;
  std::vector<Candidate>& candidates_;
};

}  // namespace

void stop_at_impacts(World::State& s, Executor& executor) {
  if (s.fast.any || !s.moving.empty()) Stops(s, executor).find_and_apply();
}

}  // namespace cradle
