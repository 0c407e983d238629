/// What pairs of bodies remember from tick to tick: their manifold, while it holds, and its axis,
/// from which the next search begins.
///
/// Manifolds stay at their place while their pair lasts; a pair that ends leaves its place to a
/// later one. Places depend on the pairs of all ticks so far and on nothing else.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/broad_phase.h"
#include "server/collision/kept_manifold.h"

namespace cradle {

/// A pair by the ids of its bodies, a < b. Plain numbers without padding.
struct KeptPair {
  std::int64_t a = 0, b = 0;
  std::int64_t place = -1;                   ///< of its manifold; -1: the pair is not worth keeping
  std::int64_t count = 0;                    ///< points of the manifold
  std::int64_t is_held = 0;                  ///< 1: the manifold is not of this tick
  double bears_m = 0;                        ///< how much motion the manifold bears
  double margin_m = 0;                       ///< that it was made with
  std::uint64_t choice = 0;                  ///< as of the last manifold
  std::int64_t is_slow = 0;                  ///< 1: the next one is likely to be kept
  double turned_m = 0;                       ///< the bodies' ways by turning when it was made
  Vector p_AoBo = Vector::Constant(kNever);  ///< m, in W, then

  static constexpr double kNever = 1e300;
  bool is_new() const { return p_AoBo.x() == kNever; }

  /// To be made anew.
  void begin(const Pose& X_WA, const Pose& X_WB, double turned) {
    p_AoBo = X_WB.x - X_WA.x;
    turned_m = turned;
    bears_m = 0;
  }
  /// m, since it was made.
  double motion(const Pose& X_WA, const Pose& X_WB, double turned) const {
    return (X_WB.x - X_WA.x - p_AoBo).norm() + (turned - turned_m);
  }
};

class PairMemory {
 public:
  /// Takes over the pairs of this tick, sorted; `ids` and `shapes` by slot. Pairs that were there
  /// last tick keep what they have, others that are worth it get an empty place.
  void follow(Executor& executor, std::span<const BodyPair> pairs,
              std::span<const std::int64_t> ids, std::span<const Shape> shapes);

  /// Whether what is kept of the k-th pair, of convex shapes, holds still; else a fresh manifold is
  /// to be made, and kept. `turned`: the way that the points of both bodies have gone at most by
  /// turning, together, since the world began, m. `reach`: radius of the ball that holds the
  /// smaller body, m. Pairs may be asked side by side.
  bool holds(std::size_t k, const Pose& X_WA, const Pose& X_WB, double turned, double reach,
             double margin);
  /// Of what holds: into `manifold`, or false if nothing touches.
  bool recall(std::size_t k, const Pose& X_WA, const Pose& X_WB, Manifold& manifold) const;
  /// Likewise of a pair with a mesh or a height field, which is not worth keeping: whether it is
  /// still certain that nothing is within the margin.
  bool is_apart(std::size_t k, const Pose& X_WA, const Pose& X_WB, double turned, double margin);
  /// It is not, but nothing was found: the two are at least so far apart, m.
  void keep_apart(std::size_t k, double distance) { pairs_[k].bears_m = distance; }

  /// The manifold to be made is likely to be kept: the last one was, or its bodies have hardly
  /// moved since.
  bool is_slow(std::size_t k) const { return pairs_[k].is_slow != 0; }
  /// In A, unit: along which the two touched last, or were apart; zero: not known. Of pairs that
  /// begin at an axis.
  Vector axis_A(std::size_t k) const {
    const std::int64_t place = pairs_[k].place;
    return place < 0 ? Vector(Vector::Zero()) : manifolds_[static_cast<std::size_t>(place)].n_A;
  }
  std::uint64_t choice(std::size_t k) const { return pairs_[k].choice; }
  bool was_apart(std::size_t k) const { return pairs_[k].count == 0; }
  /// Fetches what `recall` may read: manifolds lie anywhere, and to wait for them takes longer
  /// than all else that it does.
  void expect(std::size_t k) const;
  /// `begins_at_axis`: its axis is kept though the manifold is not.
  void keep(std::size_t k, const Pose& X_WA, const Pose& X_WB, double reach, const Manifold& made,
            bool begins_at_axis);

  /// Puts pairs by for which `sleeps(id, id)`, with what they have, until they are taken up.
  template <class Sleeps>
  void put_by(Sleeps&& sleeps) {
    const std::size_t before = put_by_.size();
    std::erase_if(pairs_, [&](const KeptPair& pair) {
      if (!sleeps(pair.a, pair.b)) return false;
      put_by_.push_back(pair);
      return true;
    });
    merge(put_by_, before);
  }

  /// Takes up what was put by of pairs with any of these bodies (ids ascending): as if they had
  /// been there last tick.
  void take_up(std::span<const std::int64_t> ids);

  /// In this tick: the manifold was not made anew.
  bool was_held(std::size_t k) const { return pairs_[k].is_held != 0; }

  /// Calls `array(name, values)` for all that influences the next tick.
  template <class F>
  void for_each_array(F&& array) {
    array("kept pairs", pairs_);
    array("pairs put by", put_by_);
    array("kept manifolds", manifolds_);
    array("free places", free_);
  }

 private:
  void follow_some(std::span<const BodyPair> pairs, std::span<const std::int64_t> ids,
                   std::size_t begin, std::size_t end);
  void release(const KeptPair& pair);
  /// Sorts pairs whose first `sorted` ones are.
  static void merge(std::vector<KeptPair>& pairs, std::size_t sorted);

  std::vector<KeptPair> pairs_, last_, put_by_;  ///< sorted
  std::vector<KeptManifold> manifolds_;
  std::vector<std::uint8_t> is_fresh_, is_gone_;  ///< by place in pairs_ and last_, for follow()
  std::vector<std::int64_t> free_;                ///< places, the next to be taken last
};

static_assert(sizeof(KeptPair) == 13 * 8);
static_assert(sizeof(KeptManifold) == 8 * (3 + 4 * 7));

}  // namespace cradle
