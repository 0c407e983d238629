/// Pairs with a hull and nothing curved, a few at a time. Private to this folder: others go by
/// narrow_phase.h.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "server/collision/collider.h"
#include "server/collision/manifold.h"
#include "server/collision/pair_hints.h"
#include "server/collision/polytope_search.h"

namespace cradle {

/// Goes on with one search while another waits for its support point. A manifold does not depend on
/// who else is in it.
class PolytopeBatch {
 public:
  static constexpr std::size_t kAtATime = 2;

  explicit PolytopeBatch(MadeManifolds& made) : made_(made) {}

  static bool takes(const Collider& A, const Collider& B);

  /// Shapes and poses must last until they are made.
  void add(std::size_t key, const Collider& A, const Collider& B, double margin,
           const PairHints& hints);
  /// Makes the manifolds of the pairs that wait.
  void finish();

 private:
  struct Meeting {
    std::size_t key;
    bool is_swapped;  ///< A of the pair is B here
    const Pose& X_WA;
    double margin;
    ConvexPair pair;
    SupportHints hints;
    PolytopeSearch search;

    Meeting(std::size_t the_key, const Collider& A, const Collider& B, double the_margin,
            bool swapped, bool wants_lead, const Vector& axis_W, std::uint32_t names)
        : key(the_key),
          is_swapped(swapped),
          X_WA(A.X_WB),
          margin(the_margin),
          pair(A, B),
          search(pair, margin + pair.radii(), wants_lead ? lead_worth_knowing(pair) : 0, hints,
                 axis_W.isZero(0) ? pair.middles() : Vector(A.X_WB.R.transpose() * axis_W),
                 pair.is_finite() ? names : 0) {}
  };

  void step();
  void make(std::optional<Meeting>& meeting);

  MadeManifolds& made_;
  std::array<std::optional<Meeting>, kAtATime> meetings_;
  std::size_t count_ = 0;
};

}  // namespace cradle
