/// What pairs of bodies remember from tick to tick: their manifold, while it holds, and its axis,
/// from which the next search begins.
///
/// It stays at its place while the pair lasts; a pair that ends leaves its place to a later one.
/// Places depend on the pairs of all ticks so far and on nothing else.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/broad_phase.h"
#include "server/collision/fetch.h"
#include "server/collision/kept_manifold.h"
#include "server/world/pair_name.h"

namespace cradle {

/// What a pair keeps: a line of memory. Plain numbers without padding.
struct alignas(64) KeptPair {
  Vector p_AoBo = Vector::Constant(kNever);  ///< m, in W, when the manifold was made
  double turned_m = 0;                       ///< the bodies' ways by turning, then
  double bears_m = 0;                        ///< how much motion the manifold bears
  double margin_m = 0;                       ///< that it was made with
  std::int32_t count = 0;                    ///< points of the manifold
  std::uint32_t choice = 0;                  ///< as of the last manifold
  // 1 or 0:
  std::uint16_t is_worth_it = 0;     ///< to keep its manifold
  std::uint16_t begins_at_axis = 0;  ///< it is worth it, and to know an axis saves time
  std::uint16_t is_held = 0;         ///< the manifold is not of this tick
  std::uint16_t is_slow = 0;         ///< the next one is likely to be kept

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

/// Sorted by names, and where each is.
struct KeptPairs {
  std::vector<PairName> names;
  std::vector<std::int32_t> places;

  std::size_t size() const { return names.size(); }
  void resize(std::size_t size) {
    names.resize(size);
    places.resize(size);
  }
  /// At `to`, what `other` has at `k`.
  void set(std::size_t to, const KeptPairs& other, std::size_t k) {
    names[to] = other.names[k];
    places[to] = other.places[k];
  }
};

class PairMemory {
 public:
  /// Takes over the pairs of this tick, sorted; `ids` and `shapes` by slot. Pairs that were there
  /// last tick keep what they have, others get an empty place.
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
  void keep_apart(std::size_t k, double distance) { pair(k).bears_m = distance; }

  /// The manifold to be made is likely to be kept: the last one was, or its bodies have hardly
  /// moved since.
  bool is_slow(std::size_t k) const { return pair(k).is_slow != 0; }
  /// Its axis is kept though its manifold may not be.
  bool begins_at_axis(std::size_t k) const { return pair(k).begins_at_axis != 0; }
  /// In A, unit: along which the two touched last, or were apart; zero: not known. Of pairs that
  /// begin at an axis.
  const Vector& axis_A(std::size_t k) const { return manifolds_[place(k)].n_A; }
  std::uint64_t choice(std::size_t k) const { return pair(k).choice; }
  bool was_apart(std::size_t k) const { return pair(k).count == 0; }
  /// Fetches what `recall` may read, or `axis_A`: manifolds lie anywhere, and to wait for them
  /// takes longer than all else that is done with them.
  void expect(std::size_t k) const;
  /// Likewise what the pair keeps, some pairs before that: `expect` looks there.
  void expect_kept(std::size_t k) const { fetch(&pair(k)); }
  void keep(std::size_t k, const Pose& X_WA, const Pose& X_WB, double reach, const Manifold& made);

  /// Puts pairs by for which `sleeps(id, id)`, with what they have, until they are taken up.
  template <class Sleeps>
  void put_by(Sleeps&& sleeps) {
    move(now_, put_by_, [&](const PairName& pair) { return sleeps(pair.a, pair.b); });
  }

  /// Takes up what was put by of pairs with any of these bodies (ids ascending): as if they had
  /// been there last tick.
  void take_up(std::span<const std::int64_t> ids);

  /// When it was asked last: the manifold was not made anew.
  bool was_held(std::size_t k) const { return pair(k).is_held != 0; }

  /// Calls `array(name, values)` for all that influences the next tick.
  template <class F>
  void for_each_array(F&& array) {
    array("kept pairs", now_.names);
    array("places of kept pairs", now_.places);
    array("pairs put by", put_by_.names);
    array("places of pairs put by", put_by_.places);
    array("what pairs keep", pairs_);
    array("kept manifolds", manifolds_);
    array("free places", free_);
  }

 private:
  void follow_some(std::span<const BodyPair> pairs, std::span<const std::int64_t> ids,
                   std::size_t begin, std::size_t end);
  std::size_t place(std::size_t k) const { return static_cast<std::size_t>(now_.places[k]); }
  KeptPair& pair(std::size_t k) { return pairs_[place(k)]; }
  const KeptPair& pair(std::size_t k) const { return pairs_[place(k)]; }
  std::int32_t take_place(ShapeKind A, ShapeKind B);
  /// Those for which `goes(name)`.
  template <class Goes>
  void move(KeptPairs& from, KeptPairs& to, const Goes& goes);

  KeptPairs now_, last_, put_by_;
  KeptPairs moved_;                             ///< for move()
  std::vector<std::uint8_t> is_new_, is_gone_;  ///< by pair; by number in last_: for follow()
  std::vector<std::size_t> gone_;               ///< numbers in last_, likewise
  std::vector<KeptPair> pairs_;                 ///< by place
  std::vector<KeptManifold> manifolds_;         ///< likewise
  std::vector<std::int32_t> free_;              ///< places, the next to be taken last
};

template <class Goes>
void PairMemory::move(KeptPairs& from, KeptPairs& to, const Goes& goes) {
  std::size_t left = 0, going = 0;
  moved_.resize(from.size());
  for (std::size_t k = 0; k < from.size(); ++k) {
    if (goes(from.names[k])) {
      moved_.set(going++, from, k);
    } else {
      from.set(left++, from, k);
    }
  }
  from.resize(left);
  std::size_t old = to.size(), end = old + going;
  to.resize(end);
  while (going > 0) {  // from the last to the first
    const bool is_old = old > 0 && moved_.names[going - 1] < to.names[old - 1];
    to.set(--end, is_old ? to : moved_, is_old ? --old : --going);
  }
}

static_assert(sizeof(KeptPair) == 6 * 8 + 2 * 4 + 4 * 2);
static_assert(sizeof(KeptManifold) == 8 * (3 + 4 * 7));

}  // namespace cradle
