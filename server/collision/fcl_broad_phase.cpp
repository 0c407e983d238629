// The broad phase by FCL 0.7 (Pan, Chitta, Manocha, 2012): its dynamic AABB tree. The only file
// of the server that knows FCL, which must be compiled with EIGEN_MAX_ALIGN_BYTES=16.
//
// Where we differ from plain use of FCL, each for a measured reason:
// - We set the boxes: FCL's own box of a rotated object is that of its bounding sphere.
// - The tree is rebuilt now and then: update() only refits it, and it decays without bound.
// - Pairs are sorted: FCL's order depends on hashes of pointers and on the tree's history.
// - Only usable boxes enter: where the square of an extent overflows, FCL's tree builder
//   follows an uninitialised iterator, and infinities and NaN are no better.
// Which pairs come out does not depend on the tree: FCL compares the boxes of the leaves exactly.
// Cost: 0.2 .. 0.5 us a body, beside planes x boxes.
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>

#include <algorithm>

#include "server/collision/crowd.h"
#include "server/collision/pair_rules.h"

namespace cradle {
namespace {

constexpr int kCallsPerTree = 20;  // the tree has then lost a third of its speed

/// What FCL sees of a slot: a box and no geometry.
class Leaf : public fcl::CollisionObjectd {
 public:
  explicit Leaf(std::int32_t slot) : fcl::CollisionObjectd(nullptr), slot_(slot) {}

  void set_box(const Aabb& box) {
    aabb.min_ = box.lower;
    aabb.max_ = box.upper;
  }
  std::int32_t slot() const { return slot_; }

  bool in_tree = false;

 private:
  std::int32_t slot_;
};

class FclBroadPhase final : public BroadPhase {
 public:
  BroadPhaseReport find_pairs(const BroadPhaseInput& input, std::vector<BodyPair>& pairs) override {
    pairs.clear();
    const std::size_t most = pairs_max(input.boxes.size());
    const bool tree_fits = update_leaves(input.boxes) && !input.renumbered;
    if (tree_fits && ++calls_ < kCallsPerTree) {
      tree_.update();
    } else {
      rebuild_tree();
    }
    Collector collector{input.moves, pairs, most};
    tree_.collide(&collector, &collect);
    add_plane_pairs(input, most, pairs);
    if (pairs.size() > most) return find_crowd_pairs(input, pairs);  // the rule is not FCL's
    sorter_.sort(input.boxes.size(), pairs);
    BroadPhaseReport report;
    report.method = "fcl";
    report.boxes_seen = collector.seen;
    return report;
  }

 private:
  struct Collector {
    std::span<const std::uint8_t> moves;
    std::vector<BodyPair>& pairs;
    std::size_t most;
    std::int64_t seen = 0;

    void add(std::int32_t i, std::int32_t j) {
      ++seen;
      const auto [a, b] = std::minmax(i, j);
      if (moves[static_cast<std::size_t>(a)] || moves[static_cast<std::size_t>(b)]) {
        pairs.push_back({a, b});
      }
    }
  };

  /// FCL calls this for each pair of leaves whose boxes overlap; false: go on.
  static bool collect(fcl::CollisionObjectd* one, fcl::CollisionObjectd* other, void* context) {
    Collector& collector = *static_cast<Collector*>(context);
    collector.add(static_cast<Leaf*>(one)->slot(), static_cast<Leaf*>(other)->slot());
    return collector.pairs.size() > collector.most;
  }

  /// Gives each leaf its box. False if other leaves belong into the tree than are in it.
  bool update_leaves(std::span<const Aabb> boxes) {
    bool fits = leaves_.size() == boxes.size();
    if (!fits) resize_leaves(boxes.size());
    for (std::size_t slot = 0; slot < boxes.size(); ++slot) {
      Leaf& leaf = leaves_[slot];
      const bool usable = is_usable(boxes[slot]);
      if (usable) leaf.set_box(boxes[slot]);
      fits = fits && leaf.in_tree == usable;
      leaf.in_tree = usable;
    }
    return fits;
  }

  void resize_leaves(std::size_t size) {
    tree_.clear();  // it points to the leaves
    leaves_.clear();
    leaves_.reserve(size);
    for (std::size_t slot = 0; slot < size; ++slot) {
      leaves_.emplace_back(static_cast<std::int32_t>(slot));
    }
  }

  void rebuild_tree() {
    calls_ = 0;
    tree_.clear();
    objects_.clear();
    for (Leaf& leaf : leaves_) {
      if (leaf.in_tree) objects_.push_back(&leaf);
    }
    tree_.registerObjects(objects_);
  }

  std::vector<Leaf> leaves_;                     // one a slot
  std::vector<fcl::CollisionObjectd*> objects_;  // those in the tree
  fcl::DynamicAABBTreeCollisionManagerd tree_;
  PairSorter sorter_;
  int calls_ = 0;  // since the tree was built
};

}  // namespace

std::unique_ptr<BroadPhase> make_fcl_broad_phase() { return std::make_unique<FclBroadPhase>(); }

}  // namespace cradle
