/// Contacts sorted into blocks of eight for the wide kernels, and back.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "server/collision/executor.h"
#include "server/collision/large_array.h"
#include "server/dynamics/contact/body_lines.h"
#include "server/dynamics/contact/colouring.h"
#include "server/dynamics/contact/contact_block.h"
#include "server/dynamics/contact/contact_constraint.h"

namespace cradle {

/// A contact with rolling or torsional friction, and where its impulses are.
struct PlacedContact {
  ContactConstraint* c;
  ContactBlock* block;
  int lane;
};

inline BlockRun part_of(const BlockRun& run, ContactBlock* blocks, std::int32_t count) {
  return {blocks, count, run.points, run.joint, run.is_round};
}

class ContactBlocks {
 public:
  /// Those of `constraints` whose arms hold at the tick's start; the others are for one after
  /// another. `h`: the sub-step, s. Calls `filled(run)` for each block alone, side by side, while
  /// it is at hand.
  template <class F>
  void pack(Executor& executor, const ContactKernels& kernels,
            std::span<ContactConstraint* const> constraints, const BodyLines& bodies, double h,
            const F& filled) {
    find_places(executor, constraints, bodies);
    in_any_order(executor, [&](const BlockRun& run) {
      for (ContactBlock& block : blocks_of(run)) {
        if (&block + 1 < run.blocks + run.count) expect(*(&block + 1), run.points);
        fill(block, run, kernels, bodies, h);
        filled(part_of(run, &block, 1));
      }
    });
    note_places(bodies);
  }
  void pack(Executor& executor, const ContactKernels& kernels,
            std::span<ContactConstraint* const> constraints, const BodyLines& bodies, double h) {
    pack(executor, kernels, constraints, bodies, h, [](const BlockRun&) {});
  }
  /// Arms of contacts with kinematic bodies that spin: to where the contacts are by now.
  void follow_driven(const BodyLines& bodies);
  /// The warm start of contacts of struck bodies alone.
  void repeat_struck(Executor& executor, const ContactKernels& kernels, BodyLines& bodies);
  /// Leaves of their impulses this part, by island.
  void scale_struck(Executor& executor, const ContactKernels& kernels,
                    std::span<const double> shares, const BodyLines& bodies);
  /// The forces of the last sub-step, separations and effective masses, and what presses. Returns
  /// the largest sag of what lasts, m.
  /// Calls `f(part, block)` as `in_parts` does, for each block alone, before its results are taken.
  template <class F>
  double unpack(Executor& executor, const ContactKernels& kernels, const BlockTaking& taking,
                const F& f) {
    sags_.assign(parts(), {});
    in_parts(executor, [&](std::size_t part, const BlockRun& run) {
      for (ContactBlock& block : blocks_of(run)) {
        const BlockRun one = part_of(run, &block, 1);
        if (&block + 1 < run.blocks + run.count) expect_results(*(&block + 1), run.points);
        f(part, one);
        kernels.scatter(one, taking, sags_[part].by_lane);
      }
    });
    double most = 0;
    for (const Sags& sags : sags_) most = std::max(most, std::ranges::max(sags.by_lane));
    return most;
  }

  /// Calls `f(run)` with parts of all runs: colour after colour, those of one colour side by side.
  template <class F>
  void in_order(Executor& executor, const F& f) const {
    for (const Colour& colour : colours_) {
      const std::span runs = std::span(runs_).subspan(colour.first, colour.runs);
      if (colour.is_serial) {
        std::ranges::for_each(runs, f);
      } else {
        side_by_side(executor, runs, colour.blocks, f);
      }
    }
  }
  /// Likewise, in any order.
  template <class F>
  void in_any_order(Executor& executor, const F& f) const {
    side_by_side(executor, runs_, static_cast<int>(used_), f);
  }
  /// Of those that are packed; until the next ones are.
  std::span<const PlacedContact> turning() const { return turning_; }

  /// All, in order.
  std::span<const BlockRun> runs() const { return runs_; }
  /// For sums: calls `f(part, run)` for parts with as many blocks each, whatever the threads.
  template <class F>
  void in_parts(Executor& executor, const F& f) const {
    for_chunks(
        executor, used_, kBlocksAPart, [&](std::size_t part, std::size_t begin, std::size_t end) {
          for (const BlockRun& run : runs_) {
            const auto start = static_cast<std::size_t>(run.blocks - blocks_.data());
            const std::size_t first = std::max(begin, start);
            const std::size_t last = std::min(end, start + static_cast<std::size_t>(run.count));
            if (first >= last) continue;
            f(part,
              part_of(run, run.blocks + (first - start), static_cast<std::int32_t>(last - first)));
          }
        });
  }
  std::size_t parts() const { return chunks_of(used_, kBlocksAPart); }

 private:
  /// A contact with a kinematic body.
  struct Driven {
    std::size_t block;
    int lane;
    bool is_A;      // or B
    Vector arm, n;  // m, at the tick's start
  };

  /// Runs of blocks of which no two move the same body; unless they are those of no colour.
  struct Colour {
    std::size_t first, runs;
    int blocks;
    bool is_serial;
  };
  static constexpr std::size_t kBlocksAPart = 32;
  static constexpr int kBlocksWorthAThread = 8;  // of up to a tenth of a microsecond each

  static std::span<ContactBlock> blocks_of(const BlockRun& run) {
    return {run.blocks, static_cast<std::size_t>(run.count)};
  }

  /// A part of the indices is that part of each run: then a thread that has the same part of each
  /// colour has contacts of the same bodies.
  template <class F>
  static void side_by_side(Executor& executor, std::span<const BlockRun> runs, int blocks,
                           const F& f) {
    executor.for_ranges(blocks, kBlocksWorthAThread, [&](int begin, int end) {
      if (end - begin == blocks) return std::ranges::for_each(runs, f), void();
      for (const BlockRun& run : runs) {
        const auto at = [&](std::int64_t k) {
          return static_cast<std::int32_t>(k * run.count / blocks);
        };
        const std::int32_t first = at(begin), count = at(end) - first;
        if (count > 0) f(part_of(run, run.blocks + first, count));
      }
    });
  }

  /// What there is to know of a constraint before it is placed.
  struct Look {
    ColouredPair bodies;
    std::int32_t kind;
    bool is_idle, is_ahead, turns_heavily;
  };
  void look_at_all(Executor& executor, std::span<ContactConstraint* const> constraints,
                   const BodyLines& bodies);
  void count_groups(std::span<ContactConstraint* const> constraints, const BodyLines& bodies);
  void find_places(Executor& executor, std::span<ContactConstraint* const> constraints,
                   const BodyLines& bodies);
  void expect(const ContactBlock& block, int points) const;
  static void expect_results(const ContactBlock& block, int points);
  void fill(ContactBlock& block, const BlockRun& run, const ContactKernels& kernels,
            const BodyLines& bodies, double h);
  void note_places(const BodyLines& bodies);
  void note_driven(std::size_t block, int lane, const ContactConstraint& c,
                   const BodyLines& bodies);
  void make_runs(const BodyLines& bodies);
  void place();

  Colouring colouring_;
  std::vector<Look> looks_;  // of all constraints
  std::vector<ColouredPair> pairs_;
  std::vector<ContactConstraint*> sources_;  // the constraints of `pairs_`
  std::vector<std::size_t> heavy_;           // which of them roll or turn with friction
  std::vector<std::int32_t> places_;         // where each is: its block times lanes, plus its lane
  std::vector<std::int32_t> groups_;  // and where they belong: by colour, then number of points
  std::vector<std::uint8_t> is_idle_;
  std::vector<std::int32_t> counts_, busy_;  // of each group: all, and those that are not idle
  LargeArray<ContactBlock> blocks_;          // the first `used_` of them
  std::size_t used_ = 0;
  std::vector<BlockRun> runs_;
  std::vector<Colour> colours_;
  std::vector<PlacedContact> turning_;
  std::vector<Driven> driven_;
  struct Sags {
    alignas(64) ContactBlock::Row by_lane;
  };
  std::vector<Sags> sags_;  // by part
};

}  // namespace cradle
