#include "server/world/pair_memory.h"

#include <algorithm>
#include <utility>

#include "server/collision/tolerances.h"

namespace cradle {
namespace {

constexpr std::size_t kChunk = 512;  // pairs that one thread takes at a time

bool is_before(const KeptPair& p, const KeptPair& q) { return p.a != q.a ? p.a < q.a : p.b < q.b; }

}  // namespace

void PairMemory::follow(Executor& executor, std::span<const BodyPair> pairs,
                        std::span<const std::int64_t> ids, std::span<const Shape> shapes) {
  std::swap(pairs_, last_);
  pairs_.resize(pairs.size());
  is_fresh_.resize(pairs.size());
  is_gone_.assign(last_.size(), 1);
  for_chunks(executor, pairs.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    follow_some(pairs, ids, begin, end);
  });
  std::size_t old = 0;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    if (is_fresh_[k] == 0) continue;
    for (; old < last_.size() && (is_gone_[old] == 0 || is_before(last_[old], pairs_[k])); ++old) {
      if (is_gone_[old] != 0) release(last_[old]);
    }
    const auto a = static_cast<std::size_t>(pairs[k].a), b = static_cast<std::size_t>(pairs[k].b);
    if (!is_worth_keeping(shapes[a].kind, shapes[b].kind)) continue;
    if (free_.empty()) {
      free_.push_back(static_cast<std::int64_t>(manifolds_.size()));
      manifolds_.emplace_back();
    }
    pairs_[k].place = free_.back();
    free_.pop_back();
    manifolds_[static_cast<std::size_t>(pairs_[k].place)].n_A = Vector::Zero();
  }
  for (; old < last_.size(); ++old) {
    if (is_gone_[old] != 0) release(last_[old]);
  }
}

/// Pairs that were there keep what they have; who is fresh or gone is left to others.
void PairMemory::follow_some(std::span<const BodyPair> pairs, std::span<const std::int64_t> ids,
                             std::size_t begin, std::size_t end) {
  auto old = last_.cend();
  for (std::size_t k = begin; k < end; ++k) {
    const KeptPair now{ids[static_cast<std::size_t>(pairs[k].a)],
                       ids[static_cast<std::size_t>(pairs[k].b)]};
    if (k == begin) old = std::lower_bound(last_.cbegin(), last_.cend(), now, is_before);
    while (old != last_.cend() && is_before(*old, now)) ++old;
    is_fresh_[k] = old == last_.cend() || is_before(now, *old) ? 1 : 0;
    pairs_[k] = is_fresh_[k] != 0 ? now : *old;
    if (is_fresh_[k] == 0) is_gone_[static_cast<std::size_t>(old++ - last_.cbegin())] = 0;
  }
}

bool PairMemory::holds(std::size_t k, const Pose& X_WA, const Pose& X_WB, double turned,
                       double reach, double margin) {
  KeptPair& pair = pairs_[k];
  if (pair.place < 0) return false;
  const bool was_held = pair.is_held != 0;
  const double motion = pair.motion(X_WA, X_WB, turned);
  pair.is_held = pair.count > 0
                     ? motion < pair.bears_m && margin <= pair.margin_m + kTolerances.kept_margin_m
                     : motion + margin < pair.bears_m;
  if (pair.is_held != 0) return true;
  pair.is_slow = was_held || pair.is_new() || motion < most_bearable_motion(reach);
  pair.begin(X_WA, X_WB, turned);
  pair.margin_m = margin;
  return false;
}

bool PairMemory::recall(std::size_t k, const Pose& X_WA, const Pose& X_WB,
                        Manifold& manifold) const {
  const KeptPair& pair = pairs_[k];
  if (pair.count == 0) return false;
  pose(manifolds_[static_cast<std::size_t>(pair.place)], static_cast<int>(pair.count), X_WA, X_WB,
       manifold);
  return true;
}

bool PairMemory::is_apart(std::size_t k, const Pose& X_WA, const Pose& X_WB, double turned,
                          double margin) {
  KeptPair& pair = pairs_[k];
  pair.is_held = pair.place < 0 && pair.motion(X_WA, X_WB, turned) + margin < pair.bears_m;
  if (pair.is_held == 0) pair.begin(X_WA, X_WB, turned);
  return pair.is_held != 0;
}

void PairMemory::expect(std::size_t k) const {
  if (pairs_[k].place < 0 || pairs_[k].count == 0 || !(pairs_[k].bears_m > 0)) return;
  const auto& manifold = manifolds_[static_cast<std::size_t>(pairs_[k].place)];
  constexpr std::size_t kLine = 64;
  const auto* const begin = reinterpret_cast<const char*>(&manifold);
  for (std::size_t at = 0; at < sizeof(manifold); at += kLine) __builtin_prefetch(begin + at);
}

void PairMemory::keep(std::size_t k, const Pose& X_WA, const Pose& X_WB, double reach,
                      const Manifold& made, bool begins_at_axis) {
  KeptPair& pair = pairs_[k];
  if (pair.place < 0) return;
  const bool is_worth_it = made.count == 0 || pair.is_slow != 0;
  const double bears = is_worth_it ? bearable_motion(made, reach) : 0;
  pair.count = made.count;
  pair.choice = made.choice;
  pair.bears_m = bears;
  KeptManifold& kept = manifolds_[static_cast<std::size_t>(pair.place)];
  if (made.count > 0 && bears > 0) {
    cradle::keep(made, X_WA, X_WB, kept);
  } else if (begins_at_axis && (made.count > 0 || made.lead > 0)) {  // not for long, or no points
    kept.n_A = X_WA.R.transpose() * made.normal_W;
  }
}

void PairMemory::take_up(std::span<const std::int64_t> ids) {
  const auto is_among = [&](std::int64_t id) {
    return std::binary_search(ids.begin(), ids.end(), id);
  };
  const std::size_t before = pairs_.size();
  std::erase_if(put_by_, [&](const KeptPair& pair) {
    if (!is_among(pair.a) && !is_among(pair.b)) return false;
    pairs_.push_back(pair);
    return true;
  });
  merge(pairs_, before);
}

void PairMemory::merge(std::vector<KeptPair>& pairs, std::size_t sorted) {
  const auto middle = pairs.begin() + static_cast<std::ptrdiff_t>(sorted);
  std::inplace_merge(pairs.begin(), middle, pairs.end(), is_before);
}

void PairMemory::release(const KeptPair& pair) {
  if (pair.place >= 0) free_.push_back(pair.place);
}

}  // namespace cradle
