#pragma once

#include <algorithm>

#include "server/collision/fetch.h"
#include "server/collision/index.h"
#include "server/collision/narrow_phase.h"
#include "server/world/state.h"

namespace cradle {

/// The manifolds of pairs of convex shapes: last tick's, while they hold; boxes many at a time.
class Narrow final : public MadeManifolds {
 public:
  /// For the pairs before `end`.
  Narrow(World::State& s, int end) : s_(s), end_(index(end)), fresh_(*this, s.settings.lanes) {}

  void find(std::size_t k) {
    const std::size_t a = index(s_.pairs[k].a), b = index(s_.pairs[k].b);
    const double margin = s_.margin(s_.pairs[k]);
    if (s_.settings.is_planar) {
      s_.set_manifold(k, s_.methods().collide(s_.collider(a), s_.collider(b), margin));
      return;
    }
    constexpr std::size_t kAhead = 8;
    if (k + 2 * kAhead < end_) s_.memory.expect_kept(k + 2 * kAhead);
    if (k + kAhead < end_) s_.memory.expect(k + kAhead);
    const double turned = s_.turned[a] + s_.turned[b];
    const double reach = std::min(s_.reaches[a], s_.reaches[b]);
    if (s_.memory.holds(k, s_.poses[a], s_.poses[b], turned, reach, margin)) {
      s_.is_touching[k] = s_.memory.recall(k, s_.poses[a], s_.poses[b], s_.manifolds[k]) ? 1 : 0;
      return;
    }
    const Collider A = s_.collider(a), B = s_.collider(b);
    PairHints hints;
    hints.wants_lead = s_.memory.is_slow(k);
    hints.foresight = s_.turns[a] + s_.turns[b];
    hints.choice = s_.memory.choice(k);
    expect_points(k, hints.choice != 0);
    if (s_.memory.begins_at_axis(k)) {
      hints.axis_W = s_.poses[a].R * s_.memory.axis_A(k);
      hints.was_apart = s_.memory.was_apart(k);
    }
    fresh_.add(k, A, B, margin, hints);
  }
  void finish() { fresh_.finish(); }
  Manifold& room(std::size_t k) override { return s_.manifolds[k]; }
  void take(std::size_t k, const Manifold& made) override {
    const std::size_t a = index(s_.pairs[k].a), b = index(s_.pairs[k].b);
    s_.set_manifold(k, made);
    s_.memory.keep(k, s_.poses[a], s_.poses[b], std::min(s_.reaches[a], s_.reaches[b]), made);
  }

 private:
  /// Fetches where the manifold of a pair goes, if it touched; that is chance, so there is no
  /// branch: else something that is there is fetched.
  void expect_points(std::size_t k, bool touched) const {
    const void* const places[] = {this, &s_.manifolds[k]};
    fetch(places[touched ? 1 : 0], sizeof(Manifold));
  }

  World::State& s_;
  std::size_t end_;
  Collisions fresh_;
};

}  // namespace cradle
