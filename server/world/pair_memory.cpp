#include "server/world/pair_memory.h"

#include <algorithm>
#include <utility>

#include "server/collision/fetch.h"
#include "server/collision/in_order.h"
#include "server/collision/narrow_phase.h"
#include "server/collision/tolerances.h"

namespace cradle {
namespace {

constexpr std::size_t kPairsChunk = 512;  // pairs that one thread takes at a time

}  // namespace

void PairMemory::follow(Executor& executor, std::span<const BodyPair> pairs,
                        std::span<const std::int64_t> ids, std::span<const Shape> shapes) {
  std::swap(now_, last_);
  now_.resize(pairs.size());
  is_new_.resize(pairs.size());
  is_gone_.assign(last_.size(), 1);
  for_chunks(executor, pairs.size(), kPairsChunk,
             [&](std::size_t, std::size_t begin, std::size_t end) {
               follow_some(pairs, ids, begin, end);
             });
  gone_.clear();
  for_all_marked(is_gone_, [this](std::size_t old) { gone_.push_back(old); });
  auto next = gone_.cbegin();
  for_all_marked(is_new_, [&](std::size_t k) {
    while (next != gone_.cend() && last_.names[*next] < now_.names[k]) {
      free_.push_back(last_.places[*next++]);
    }
    const auto a = static_cast<std::size_t>(pairs[k].a), b = static_cast<std::size_t>(pairs[k].b);
    now_.places[k] = take_place(shapes[a].kind, shapes[b].kind);
  });
  while (next != gone_.cend()) free_.push_back(last_.places[*next++]);
}

std::int32_t PairMemory::take_place(ShapeKind A, ShapeKind B) {
  if (free_.empty()) {
    free_.push_back(static_cast<std::int32_t>(pairs_.size()));
    pairs_.emplace_back();
    manifolds_.emplace_back();
  }
  const std::int32_t place = free_.back();
  free_.pop_back();
  KeptPair& pair = pairs_[static_cast<std::size_t>(place)] = {};
  pair.is_worth_it = is_worth_keeping(A, B) ? 1 : 0;
  pair.begins_at_axis = pair.is_worth_it != 0 && cradle::begins_at_axis(A, B) ? 1 : 0;
  if (pair.begins_at_axis != 0) manifolds_[static_cast<std::size_t>(place)].n_A = Vector::Zero();
  return place;
}

/// Which pairs were there, and where, and which are gone.
void PairMemory::follow_some(std::span<const BodyPair> pairs, std::span<const std::int64_t> ids,
                             std::size_t begin, std::size_t end) {
  const std::vector<PairName>& last = last_.names;
  auto old = last.cend();
  for (std::size_t k = begin; k < end; ++k) {
    const PairName name{ids[static_cast<std::size_t>(pairs[k].a)],
                        ids[static_cast<std::size_t>(pairs[k].b)]};
    if (k == begin) old = std::lower_bound(last.cbegin(), last.cend(), name);
    while (old != last.cend() && *old < name) ++old;
    now_.names[k] = name;
    const bool is_new = old == last.cend() || name < *old;
    is_new_[k] = is_new ? 1 : 0;
    if (is_new) continue;
    const auto number = static_cast<std::size_t>(old++ - last.cbegin());
    now_.places[k] = last_.places[number];
    is_gone_[number] = 0;
  }
}

bool PairMemory::holds(std::size_t k, const Pose& X_WA, const Pose& X_WB, double turned,
                       double reach, double margin) {
  KeptPair& pair = this->pair(k);
  if (pair.is_worth_it == 0) return false;
  const bool was_held = pair.is_held != 0;
  const double motion = pair.motion(X_WA, X_WB, turned);
  // Which of both it is is chance, so: no branches.
  const bool touches = pair.count > 0;
  const double counts_as_motion[] = {margin, 0};
  pair.is_held = (motion + counts_as_motion[touches ? 1 : 0] < pair.bears_m) &
                 (!touches | (margin <= pair.margin_m + kTolerances.kept_margin_m));
  if (pair.is_held != 0) return true;
  const bool is_new = pair.is_new(), has_hardly_moved = motion < most_bearable_motion(reach);
  pair.is_slow = was_held | is_new | has_hardly_moved;
  pair.begin(X_WA, X_WB, turned);
  pair.margin_m = margin;
  return false;
}

bool PairMemory::recall(std::size_t k, const Pose& X_WA, const Pose& X_WB,
                        Manifold& manifold) const {
  const int count = pair(k).count;
  if (count == 0) return false;
  pose(manifolds_[place(k)], count, X_WA, X_WB, manifold);
  return true;
}

bool PairMemory::is_apart(std::size_t k, const Pose& X_WA, const Pose& X_WB, double turned,
                          double margin) {
  KeptPair& pair = this->pair(k);
  pair.is_held = pair.is_worth_it == 0 && pair.motion(X_WA, X_WB, turned) + margin < pair.bears_m;
  if (pair.is_held == 0) pair.begin(X_WA, X_WB, turned);
  return pair.is_held != 0;
}

void PairMemory::expect(std::size_t k) const {
  const KeptPair& pair = this->pair(k);
  // It is chance, so: no branches. What is not needed is something that is there.
  const bool may_hold = (pair.is_worth_it != 0) & (pair.count > 0) & (pair.bears_m > 0);
  const KeptManifold& manifold = manifolds_[place(k)];
  const void* const begins[] = {&pair, &manifold};
  const bool is_read = may_hold | (pair.begins_at_axis != 0);
  fetch(begins[is_read ? 1 : 0], sizeof(manifold.n_A));
  fetch(begins[may_hold ? 1 : 0], sizeof(manifold));
}

void PairMemory::keep(std::size_t k, const Pose& X_WA, const Pose& X_WB, double reach,
                      const Manifold& made) {
  KeptPair& pair = this->pair(k);
  if (pair.is_worth_it == 0) return;
  const bool may_hold = (made.count == 0) | (pair.is_slow != 0);
  const double bears = may_hold ? bearable_motion(made, reach) : 0;
  pair.count = made.count;
  pair.choice = static_cast<std::uint32_t>(made.choice);
  pair.bears_m = bears;
  KeptManifold& kept = manifolds_[place(k)];
  if (made.count > 0 && bears > 0) {
    cradle::keep(made, X_WA, X_WB, kept);
  } else if (pair.begins_at_axis != 0 &&
             (made.count > 0 || made.lead > 0)) {  // not for long, or no points
    kept.n_A = X_WA.R.transpose() * made.normal_W;
  }
}

void PairMemory::take_up(std::span<const std::int64_t> ids) {
  const auto is_among = [&](std::int64_t id) {
    return std::binary_search(ids.begin(), ids.end(), id);
  };
  move(put_by_, now_, [&](const PairName& pair) { return is_among(pair.a) || is_among(pair.b); });
}

}  // namespace cradle
