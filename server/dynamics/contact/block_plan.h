/// Which contact is solved in which lane of which block, and who may work side by side: domains
/// (domains.h), and in each the contacts of one colour.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/executor.h"
#include "server/dynamics/contact/body_lines.h"
#include "server/dynamics/contact/colouring.h"
#include "server/dynamics/contact/contact_block.h"
#include "server/dynamics/contact/contact_constraint.h"

namespace cradle {

/// What a block's manifolds have in common.
struct BlockKind {
  int points;
  bool joint, is_round;
};

/// Blocks of one kind and colour, or of no colour. Those of a task come one after another.
struct PlannedRun {
  std::int32_t first, count;
  BlockKind kind;
  std::int32_t task;
};

/// Tasks that may be done side by side.
struct TaskLevel {
  std::int32_t begin, end;
};

/// Keeps its memory from batch to batch.
class BlockPlan {
  template <class T>
  static auto& at(T& all, std::int32_t k) {
    return all[static_cast<std::size_t>(k)];
  }

 public:
  /// For blocks of numbers of one kind: how many lanes they have, and whether all points of a
  /// manifold may be solved at once.
  BlockPlan(int width, bool may_join) : width_(width), may_join_(may_join) {}

  /// Of those whose arms hold at the tick's start; the others are for one after another.
  void make(Executor& executor, std::span<ContactConstraint* const> constraints,
            const BodyLines& bodies);

  /// In the order of tasks; the lines of the bodies that yield, or -1; and where each is: its block
  /// times lanes, plus its lane.
  std::span<ContactConstraint* const> sources() const { return sources_; }
  std::span<const ColouredPair> pairs() const { return pairs_; }
  std::span<const std::int32_t> places() const { return places_; }
  /// Which of them roll or turn with friction.
  std::span<const std::int32_t> heavy() const { return heavy_; }

  std::size_t blocks() const { return lanes_.size() / static_cast<std::size_t>(width_); }
  /// Of a block: the sources in its lanes; -1: none.
  std::span<const std::int32_t> lanes(std::size_t block) const {
    const auto width = static_cast<std::size_t>(width_);
    return std::span(lanes_).subspan(block * width, width);
  }
  std::span<const PlannedRun> runs() const { return runs_; }
  /// Of a task.
  std::size_t first_run(std::int32_t task) const { return at(tasks_, task).first_run; }
  std::size_t end_run(std::int32_t task) const { return at(tasks_, task).end_run; }
  /// One after the other; none is empty.
  std::span<const TaskLevel> levels() const { return levels_; }

 private:
  /// Those that are idle come last in their group.
  enum Idleness : std::uint8_t { busy, idle };
  /// What there is to know of a constraint before it is placed.
  struct Look {
    ColouredPair bodies;
    std::int32_t task, kind;
    Idleness idleness;
    bool is_ahead, turns_heavily;
  };
  /// Of one colour and kind, or of no colour.
  struct Group {
    std::array<std::int32_t, 2> count;  // by idleness: who is there, then who is still to come
    std::array<std::int32_t, 2> next;   // where the next one goes
    std::size_t goes_along;             // the group that has room for the rest
    std::int32_t all() const { return count[busy] + count[idle]; }
  };
  struct Task {
    std::size_t begin, end;  // of sources
    std::size_t first_run, end_run;
    int colours;
    std::size_t first_group;
  };
  void look_at_all(Executor& executor, std::span<ContactConstraint* const> constraints,
                   const BodyLines& bodies);
  Look look_at(const ContactConstraint& c, const BodyLines& bodies) const;
  std::int32_t lanes_of(std::size_t group) const;
  void sort_by_task(Executor& executor, std::span<ContactConstraint* const> constraints);
  std::size_t columns() const { return tasks_.size() + 1; }
  std::span<std::size_t> numbers_of(std::size_t part) {
    return std::span(numbers_).subspan(part * columns(), columns());
  }
  void colour(std::int32_t task);
  void share_groups();
  void count_groups(std::int32_t task);
  void fill_up(std::span<Group> groups, std::size_t first) const;
  std::size_t group_of(std::size_t source) const {
    return static_cast<std::size_t>(kBlockKinds * colours_[source] + kinds_[source]);
  }
  void make_runs(const TaskTree& tree);
  void place(std::int32_t task);
  std::span<Group> groups_of(std::int32_t task);

  std::int32_t width_;
  bool may_join_;
  Colouring colouring_;
  std::vector<Look> looks_;           // of all constraints
  std::vector<std::size_t> numbers_;  // of them, by part and column: look_at_all, sort_by_task
  std::vector<Task> tasks_;
  std::vector<TaskLevel> levels_;
  std::vector<Group> groups_;  // by task, those of the colours that it has
  // By source.
  std::vector<ContactConstraint*> sources_;
  std::vector<ColouredPair> pairs_;
  std::vector<std::int32_t> kinds_;
  std::vector<std::uint8_t> colours_;
  std::vector<Idleness> idleness_;
  std::vector<std::int32_t> places_;
  std::vector<std::int32_t> heavy_;  // sources
  std::vector<std::int32_t> lanes_;
  std::vector<PlannedRun> runs_;
};

}  // namespace cradle
