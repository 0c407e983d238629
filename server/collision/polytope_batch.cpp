#include "server/collision/polytope_batch.h"

namespace cradle {

bool PolytopeBatch::takes(const Collider& A, const Collider& B) {
  const auto is_hull = [](const Collider& C) {
    return C.shape.kind == ShapeKind::hull && C.hull() != nullptr;
  };
  const auto is_plain = [](const Collider& C) {
    return C.shape.kind == ShapeKind::sphere || C.shape.kind == ShapeKind::box ||
           C.shape.kind == ShapeKind::capsule;
  };
  return is_hull(A) ? is_hull(B) || is_plain(B) : is_plain(A) && is_hull(B);
}

void PolytopeBatch::add(std::size_t key, const Collider& A, const Collider& B, double margin,
                        const PairHints& hints) {
  while (count_ == kAtATime) step();
  for (std::optional<Meeting>& meeting : meetings_) {
    if (meeting) continue;
    // As in the pair table: a hull comes second.
    const bool is_swapped = B.shape.kind < A.shape.kind;
    meeting.emplace(key, is_swapped ? B : A, is_swapped ? A : B, margin, is_swapped,
                    hints.wants_lead, is_swapped ? Vector(-hints.axis_W) : hints.axis_W,
                    static_cast<std::uint32_t>(hints.choice));
    ++count_;
    if (!meeting->pair.is_finite()) {
      meeting.reset();
      --count_;
      made_.take(key, {});
    } else if (meeting->search.is_done()) {
      make(meeting);
    }
    return;
  }
}

void PolytopeBatch::finish() {
  while (count_ > 0) step();
}

void PolytopeBatch::step() {
  std::array<Difference, kAtATime> next;
  for (std::size_t i = 0; i < kAtATime; ++i) {
    if (auto& m = meetings_[i]) find_support(m->pair, m->search.direction(), m->hints, next[i]);
  }
  for (std::size_t i = 0; i < kAtATime; ++i) {
    auto& m = meetings_[i];
    if (!m) continue;
    m->search.take(next[i]);
    if (m->search.is_done()) make(m);
  }
}

void PolytopeBatch::make(std::optional<Meeting>& meeting) {
  Meeting& m = *meeting;
  Manifold manifold = convex_manifold(m.pair, m.search.best(), m.hints, m.X_WA, m.margin);
  if (m.is_swapped) manifold.normal_W = -manifold.normal_W;
  const std::size_t key = m.key;
  meeting.reset();
  --count_;
  made_.take(key, manifold);
}

}  // namespace cradle
