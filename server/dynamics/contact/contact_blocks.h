/// Contacts sorted into blocks for the wide kernels, and back.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "server/collision/executor.h"
#include "server/dynamics/contact/block_plan.h"
#include "server/dynamics/contact/body_lines.h"
#include "server/dynamics/contact/contact_block.h"
#include "server/dynamics/contact/contact_constraint.h"

namespace cradle {

// Lines of bodies, as blocks have them: by numbers.
constexpr std::int32_t begin_of(std::int32_t line) { return line * kLineNumbers; }
constexpr std::int32_t line_at(std::int32_t begin) { return begin / kLineNumbers; }

/// A contact with rolling or torsional friction, and where its impulses are.
template <class Real>
struct PlacedContact {
  ContactConstraint* c;
  ContactBlock<Real>* block;
  int lane;
};

template <class Real>
BlockRun<Real> part_of(const BlockRun<Real>& run, ContactBlock<Real>* blocks, std::int32_t count) {
  return {blocks, count, run.points, run.joint, run.is_round, run.task};
}

template <class Real>
class ContactBlocks {
 public:
  using Block = ContactBlock<Real>;
  using Run = BlockRun<Real>;
  using Passes = BlockPasses<Real>;

  /// Those of `constraints` whose arms hold at the tick's start; the others are for one after
  /// another. `h`: the sub-step, s; `give`: s^2, see softness.h. Calls `filled(run)` for each
  /// block alone, side by side, while it is at hand.
  template <class F>
  void pack(Executor& executor, const Passes& passes,
            std::span<ContactConstraint* const> constraints, const BodyLines& bodies, double h,
            double give, const F& filled) {
    plan_.make(executor, constraints, bodies);
    make_runs();
    in_any_order(executor, [&](const Run& run) {
      for (Block& block : blocks_of(run)) {
        if (&block + 1 < run.blocks + run.count) expect(number_of(block) + 1, run.points);
        fill(block, run, passes, bodies, h, give);
        filled(part_of(run, &block, 1));
      }
    });
    note_places(bodies);
  }
  void pack(Executor& executor, const Passes& passes,
            std::span<ContactConstraint* const> constraints, const BodyLines& bodies, double h,
            double give) {
    pack(executor, passes, constraints, bodies, h, give, [](const Run&) {});
  }
  /// Arms of contacts with kinematic bodies that spin: to where the contacts are by now.
  void follow_driven(const BodyLines& bodies);
  /// The warm start of contacts of struck bodies alone.
  void repeat_struck(Executor& executor, const Passes& passes, BodyLines& bodies);
  /// Leaves of their impulses this part, by island.
  void scale_struck(Executor& executor, const Passes& passes, std::span<const double> shares,
                    const BodyLines& bodies);
  /// The forces of the last sub-step, separations and effective masses, and what presses. Returns
  /// the largest sag of what lasts, m.
  /// Calls `f(part, block)` as `in_parts` does, for each block alone, before its results are taken.
  template <class F>
  double unpack(Executor& executor, const Passes& passes, const BlockTaking& taking, const F& f) {
    sags_.assign(parts(), {});
    in_parts(executor, [&](std::size_t part, const Run& run) {
      for (Block& block : blocks_of(run)) {
        const Run one = part_of(run, &block, 1);
        if (&block + 1 < run.blocks + run.count) expect_results(*(&block + 1), run.points);
        f(part, one);
        passes.scatter(one, taking, sags_[part].by_lane);
      }
    });
    Real most = 0;
    for (const Sags& sags : sags_) most = std::max(most, std::ranges::max(sags.by_lane));
    return most;
  }

  /// Calls `f(run)` for all runs: those of a task one after another, tasks of a level side by side.
  template <class F>
  void in_order(Executor& executor, const F& f) const {
    for (const TaskLevel& level : plan_.levels()) {
      for_each_index(
          executor, static_cast<std::size_t>(level.end - level.begin), 1,
          [&](std::size_t k) { do_task(level.begin + static_cast<std::int32_t>(k), f); });
    }
  }
  /// Calls `f(run)` with parts of all runs, in any order.
  template <class F>
  void in_any_order(Executor& executor, const F& f) const {
    in_parts(executor, [&f](std::size_t, const Run& run) { f(run); });
  }
  /// Of those that are packed; until the next ones are.
  std::span<const PlacedContact<Real>> turning() const { return turning_; }

  /// All, in order.
  std::span<const Run> runs() const { return runs_; }
  /// For sums: calls `f(part, run)` for parts with as many blocks each, whatever the threads.
  template <class F>
  void in_parts(Executor& executor, const F& f) const {
    for_chunks(
        executor, used_, kBlocksAPart, [&](std::size_t part, std::size_t begin, std::size_t end) {
          const auto ends_before = [&](const Run& run) {
            return number_of(*run.blocks) + static_cast<std::size_t>(run.count) <= begin;
          };
          auto run = std::ranges::partition_point(runs_, ends_before);
          for (; run != runs_.end() && number_of(*run->blocks) < end; ++run) {
            const std::size_t start = number_of(*run->blocks);
            const std::size_t first = std::max(begin, start);
            const std::size_t last = std::min(end, start + static_cast<std::size_t>(run->count));
            f(part, part_of(*run, run->blocks + (first - start),
                            static_cast<std::int32_t>(last - first)));
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

  static constexpr std::size_t kBlocksAPart = 32;

  static std::span<Block> blocks_of(const Run& run) {
    return {run.blocks, static_cast<std::size_t>(run.count)};
  }

  std::size_t number_of(const Block& block) const {
    return static_cast<std::size_t>(&block - blocks_.data());
  }
  template <class F>
  void do_task(std::int32_t task, const F& f) const {
    for (std::size_t k = plan_.first_run(task); k < plan_.end_run(task); ++k) f(runs_[k]);
  }

  void make_runs();
  void expect(std::size_t block, int points) const;
  static void expect_results(const Block& block, int points);
  void fill(Block& block, const Run& run, const Passes& passes, const BodyLines& bodies, double h,
            double give);
  void note_places(const BodyLines& bodies);
  void note_driven(std::size_t block, int lane, const ContactConstraint& c,
                   const BodyLines& bodies);

  BlockPlan plan_{Block::kLanes, kMayJoin<Real>};
  std::vector<Block> blocks_;  // the first `used_` of them
  std::size_t used_ = 0;
  std::vector<Run> runs_;  // those of the plan
  std::vector<PlacedContact<Real>> turning_;
  std::vector<Driven> driven_;
  struct Sags {
    alignas(64) typename Block::Row by_lane;
  };
  std::vector<Sags> sags_;  // by part
};

extern template class ContactBlocks<double>;
extern template class ContactBlocks<float>;

}  // namespace cradle
