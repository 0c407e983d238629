#include "server/dynamics/contact/block_plan.h"

#include <algorithm>
#include <utility>

#include "server/collision/index.h"

namespace cradle {
namespace {

/// The more general ones later.
constexpr BlockKind kKinds[] = {
    {1, false, true},  {2, false, true},  {4, false, true},  {2, true, true},  {4, true, true},
    {1, false, false}, {2, false, false}, {4, false, false}, {2, true, false}, {4, true, false}};
constexpr std::int32_t kRoundKinds = 5;
static_assert(std::size(kKinds) == kBlockKinds);
constexpr std::size_t kLooks = 256;  // that one thread takes at a time, of some nanoseconds

/// Of no colour: with a block each.
bool is_single(std::size_t group) { return group >= std::size_t{kBlockKinds} * kColours; }

/// To the same bits ("a contact does the same to the bit").
bool can_go_along(const BlockKind& kind, const BlockKind& general) {
  return kind.points <= general.points && kind.joint == general.joint &&
         kind.is_round >= general.is_round;
}

/// Points that all carried last tick, or are all new, are likely to carry together: they are solved
/// at once, which also keeps a symmetric stack symmetric. Not in a heap.
std::int32_t kind_of(const ContactConstraint& c, bool may_join, bool are_round) {
  const std::int32_t first = are_round ? 0 : kRoundKinds;
  if (c.count == 1) return first;
  const bool joint = may_join && (c.carrying == 0 || c.carrying == c.count);
  return first + (c.count == 2 ? 1 : 2) + (joint ? 2 : 0);
}

/// Neither touches nor carried: most of these do nothing in the tick either, a block of them then
/// take half the time.
bool is_idle(const ContactConstraint& c) { return (c.carrying == 0) & !c.is_met; }

}  // namespace

void BlockPlan::make(Executor& executor, std::span<ContactConstraint* const> constraints,
                     const BodyLines& bodies) {
  const TaskTree& tree = bodies.tasks();
  tasks_.assign(tree.tasks(), {});
  look_at_all(executor, constraints, bodies);
  sort_by_task(executor, constraints);
  colouring_.begin(bodies.moving());
  for (std::size_t level = 0; level < tree.levels(); ++level) {
    for_each_index(executor, index(tree.end(level) - tree.begin(level)), 1, [&](std::size_t k) {
      colour(tree.begin(level) + static_cast<std::int32_t>(k));
    });
  }
  share_groups();
  for_each_index(executor, tree.tasks(), 1,
                 [&](std::size_t task) { count_groups(static_cast<std::int32_t>(task)); });
  make_runs(tree);
  for_each_index(executor, tree.tasks(), 1,
                 [&](std::size_t task) { place(static_cast<std::int32_t>(task)); });
}

/// At each by itself; and how many each part has of each task, and in the last column how many of
/// its constraints turn heavily.
void BlockPlan::look_at_all(Executor& executor, std::span<ContactConstraint* const> constraints,
                            const BodyLines& bodies) {
  looks_.resize(constraints.size());
  numbers_.assign(chunks_of(constraints.size(), kLooks) * columns(), 0);
  for_chunks(executor, constraints.size(), kLooks,
             [&](std::size_t part, std::size_t begin, std::size_t end) {
               const std::span<std::size_t> numbers = numbers_of(part);
               for (std::size_t k = begin; k < end; ++k) {
                 expect_next(constraints, k);
                 looks_[k] = look_at(*constraints[k], bodies);
                 if (looks_[k].is_ahead) continue;
                 ++numbers[index(looks_[k].task)];
                 numbers.back() += looks_[k].turns_heavily ? 1 : 0;
               }
             });
}

std::int32_t BlockPlan::lanes_of(std::size_t group) const { return is_single(group) ? 1 : width_; }

BlockPlan::Look BlockPlan::look_at(const ContactConstraint& c, const BodyLines& bodies) const {
  const std::int32_t a = bodies.line(c.a), b = bodies.line(c.b);
  return {{bodies.yields(a) ? a : -1, bodies.yields(b) ? b : -1},
          bodies.task_of(a, b),
          kind_of(c, may_join_ && !bodies.is_in_heap(a, b), bodies.are_round(a, b)),
          is_idle(c) ? idle : busy,
          c.is_ahead,
          c.turns_heavily()};
}

/// By counting: from here on `numbers_` tells where the next one of a part goes.
void BlockPlan::sort_by_task(Executor& executor, std::span<ContactConstraint* const> constraints) {
  const std::size_t parts = chunks_of(constraints.size(), kLooks);
  const auto take_places = [&](std::size_t column, std::size_t next) {
    for (std::size_t part = 0; part < parts; ++part) {
      std::size_t& number = numbers_of(part)[column];
      next += std::exchange(number, next);
    }
    return next;
  };
  std::size_t count = 0;
  for (std::size_t number = 0; number < tasks_.size(); ++number) {
    tasks_[number].begin = count;
    tasks_[number].end = count = take_places(number, count);
  }
  heavy_.resize(take_places(tasks_.size(), 0));
  sources_.resize(count);
  pairs_.resize(count);
  kinds_.resize(count);
  idleness_.resize(count);
  colours_.resize(count);
  places_.resize(count);
  for_chunks(executor, constraints.size(), kLooks,
             [&](std::size_t part, std::size_t begin, std::size_t end) {
               const std::span<std::size_t> next = numbers_of(part);
               for (std::size_t k = begin; k < end; ++k) {
                 const Look& look = looks_[k];
                 if (look.is_ahead) continue;
                 const std::size_t to = next[index(look.task)]++;
                 sources_[to] = constraints[k];
                 pairs_[to] = look.bodies;
                 kinds_[to] = look.kind;
                 idleness_[to] = look.idleness;
                 if (look.turns_heavily) heavy_[next.back()++] = static_cast<std::int32_t>(to);
               }
             });
}

void BlockPlan::colour(std::int32_t number) {
  Task& task = at(tasks_, number);
  const std::size_t count = task.end - task.begin;
  task.colours = colouring_.colour(std::span(pairs_).subspan(task.begin, count),
                                   std::span(colours_).subspan(task.begin, count));
}

/// Batches differ in size: what one of them has no use for is not given up.
void BlockPlan::share_groups() {
  std::size_t count = 0;
  for (Task& task : tasks_) {
    task.first_group = count;
    count += std::size_t{kBlockKinds} * index(task.colours);
  }
  if (groups_.size() < count) groups_.resize(count);
}

std::span<BlockPlan::Group> BlockPlan::groups_of(std::int32_t number) {
  const Task& task = at(tasks_, number);
  return std::span(groups_).subspan(task.first_group,
                                    std::size_t{kBlockKinds} * index(task.colours));
}

void BlockPlan::count_groups(std::int32_t number) {
  const Task& task = at(tasks_, number);
  const std::span<Group> groups = groups_of(number);
  std::ranges::fill(groups, Group{});
  for (std::size_t k = task.begin; k < task.end; ++k) {
    const std::size_t group = group_of(k);
    if (is_single(group)) idleness_[k] = busy;
    ++groups[group].count[idleness_[k]];
  }
  for (int colour = 0; colour < std::min(task.colours, kColours); ++colour) {
    fill_up(groups, index(kBlockKinds * colour));
  }
}

/// What does not fill a block of its kind goes along in the last one of a more general kind, if all
/// of it has room there: fewer lanes stay empty. The most general ones are filled first, so nobody
/// joins what goes along.
void BlockPlan::fill_up(std::span<Group> groups, std::size_t first) const {
  for (std::size_t general = kBlockKinds - 1; general > 0; --general) {
    Group& to = groups[first + general];
    for (std::size_t kind = general; kind-- > 0;) {
      Group& from = groups[first + kind];
      const std::int32_t left = from.all() % width_, used = to.all() % width_;
      if (left == 0 || used == 0 || left + used > width_) continue;
      if (!can_go_along(kKinds[kind], kKinds[general])) continue;
      const std::int32_t left_idle = std::min(left, from.count[idle]);
      from.count[idle] -= left_idle;
      from.count[busy] -= left - left_idle;
      from.goes_along = first + general;
      to.count[idle] += left_idle;
      to.count[busy] += left - left_idle;
    }
  }
}

/// Blocks for all, colour after colour; of one group idle ones come last.
void BlockPlan::make_runs(const TaskTree& tree) {
  runs_.clear();
  std::int32_t next = 0;
  for (std::int32_t number = 0; index(number) < tasks_.size(); ++number) {
    Task& task = at(tasks_, number);
    task.first_run = runs_.size();
    const std::span<Group> groups = groups_of(number);
    for (std::size_t k = 0; k < groups.size(); ++k) {
      Group& group = groups[k];
      const std::int32_t lanes = lanes_of(k), count = (group.all() + lanes - 1) / lanes;
      const std::int32_t first = next * width_;
      group.next = {first, first + group.count[busy]};
      if (count == 0) continue;
      runs_.push_back({next, count, kKinds[k % kBlockKinds], number});
      next += count;
    }
    task.end_run = runs_.size();
  }
  lanes_.assign(index(next * width_), -1);
  levels_.clear();
  for (std::size_t level = 0; level < tree.levels(); ++level) {
    const TaskLevel all{tree.begin(level), tree.end(level)};
    if (first_run(all.begin) < end_run(all.end - 1)) levels_.push_back(all);
  }
}

/// Who goes where.
void BlockPlan::place(std::int32_t number) {
  const Task& task = at(tasks_, number);
  const std::span<Group> groups = groups_of(number);
  for (std::size_t k = task.begin; k < task.end; ++k) {
    const Idleness idleness = idleness_[k];
    std::size_t group = group_of(k);
    if (groups[group].count[idleness] == 0) group = groups[group].goes_along;
    --groups[group].count[idleness];
    std::int32_t& next = groups[group].next[idleness];
    places_[k] = next;
    at(lanes_, next) = static_cast<std::int32_t>(k);
    next += is_single(group) ? width_ : 1;
  }
}

}  // namespace cradle
