#include "server/dynamics/contact/contact_blocks.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "server/collision/index.h"
#include "server/dynamics/contact/softness.h"

namespace cradle {
namespace {

/// What a block's manifolds have in common.
struct Kind {
  int points;
  bool joint, is_round;
};
constexpr Kind kKinds[] = {
    {1, false, true},  {2, false, true},  {4, false, true},  {2, true, true},  {4, true, true},
    {1, false, false}, {2, false, false}, {4, false, false}, {2, true, false}, {4, true, false}};
constexpr std::int32_t kRoundKinds = 5;
constexpr int kLooksWorthAThread = 128;  // of some nanoseconds
constexpr std::int32_t kGroupsAColour = kBlockKinds;
static_assert(std::size(kKinds) == kBlockKinds);

/// Of no colour.
bool is_serial(std::int32_t group) { return group >= kGroupsAColour * kColours; }

/// Points that all carried last tick, or are all new, are likely to carry together: they are solved
/// at once, which also keeps a symmetric stack symmetric. Not in a heap.
std::int32_t kind_of(const ContactConstraint& c, bool is_in_heap, bool are_round) {
  const std::int32_t first = are_round ? 0 : kRoundKinds;
  if (c.count == 1) return first;
  const bool joint = !is_in_heap && (c.carrying == 0 || c.carrying == c.count);
  return first + (c.count == 2 ? 1 : 2) + (joint ? 2 : 0);
}

/// Neither touches nor carried: most of these do nothing in the tick either, eight abreast then
/// take half the time.
bool is_idle(const ContactConstraint& c) { return (c.carrying == 0) & !c.is_met; }

constexpr int kLine = 8;  // numbers

/// Of the constraint that a block's lane reads, the number at this place of this line.
constexpr std::size_t at(int line, std::size_t place) {
  return sizeof(double) * (static_cast<std::size_t>(line) + place);
}
using Lines = ConstraintLines;
static_assert(offsetof(ContactConstraint, n) == at(Lines::kFrame, 0));
static_assert(offsetof(ContactConstraint, t1) == at(Lines::kFrame, 3));
static_assert(offsetof(ContactConstraint, friction) == at(Lines::kFrame, 6));
static_assert(offsetof(ContactConstraint, preload) == at(Lines::kFrame, 7));
static_assert(offsetof(ContactConstraint, from_B) == at(Lines::kBodies, 0));
static_assert(offsetof(ContactConstraint, restitution) == at(Lines::kBodies, 5));
static_assert(offsetof(ContactConstraint, points) == at(Lines::kPoints, 0));
static_assert(offsetof(ContactConstraint, K_normals) == at(Lines::kMasses, 0));
static_assert(sizeof(ConstraintPoint) == at(kLine, 0));
static_assert(offsetof(ConstraintPoint, rA) == at(0, 0));
static_assert(offsetof(ConstraintPoint, s0) == at(0, 3));
static_assert(offsetof(ConstraintPoint, force_t) == at(Lines::kLoad, 0));
static_assert(offsetof(ConstraintPoint, force) == at(Lines::kLoad, 2));
static_assert(offsetof(ConstraintPoint, press) == at(Lines::kLoad, 3));

using Row = ContactBlock::Row;

void set(Row* rows, int lane, const Vector& value) {
  for (int k = 0; k < 3; ++k) rows[k][lane] = value[k];
}

/// The mean of the points: between them every point has a short lever. As an arm of A.
Vector centre(const ContactConstraint& c) {
  Vector sum = Vector::Zero();
  for (const ConstraintPoint& p : c.used()) sum += p.rA;
  return sum / static_cast<double>(c.count);
}

/// Of no constraint. Nobody writes to it.
alignas(64) double no_lines[ConstraintLines::kPoints + kBlockPoints * kLine]{};

/// Lanes without a manifold do nothing to nobody.
void clear(ContactBlock& block, std::int32_t nobody, std::int32_t waste) {
  std::fill_n(block.lines, kBlockLanes, &no_lines[0]);
  std::fill_n(block.a, kBlockLanes, nobody);
  std::fill_n(block.b, kBlockLanes, nobody);
  std::fill_n(block.a_out, kBlockLanes, waste);
  std::fill_n(block.b_out, kBlockLanes, waste);
  std::fill_n(block.source, kBlockLanes, -1);
  std::fill_n(block.yields[0], kBlockPoints * kBlockLanes, 0);
}

}  // namespace

/// Of each by itself, what the others are not asked for.
void ContactBlocks::look_at_all(Executor& executor, std::span<ContactConstraint* const> constraints,
                                const BodyLines& bodies) {
  const auto body = [&](std::int32_t slot) {
    const std::int32_t line = bodies.line(slot);
    return bodies.yields(line) ? line : -1;
  };
  const auto kind = [&](const ContactConstraint& c) {
    const std::int32_t a = bodies.line(c.a), b = bodies.line(c.b);
    return kind_of(c, bodies.is_in_heap(a, b), bodies.are_round(a, b));
  };
  looks_.resize(constraints.size());
  for_each_index(executor, constraints.size(), kLooksWorthAThread, [&](std::size_t k) {
    expect_next(constraints, k);
    const ContactConstraint& c = *constraints[k];
    looks_[k] = {{body(c.a), body(c.b)}, kind(c), is_idle(c), c.is_ahead, c.turns_heavily()};
  });
}

void ContactBlocks::count_groups(std::span<ContactConstraint* const> constraints,
                                 const BodyLines& bodies) {
  pairs_.clear();
  sources_.clear();
  heavy_.clear();
  groups_.clear();
  is_idle_.clear();
  for (std::size_t k = 0; k < constraints.size(); ++k) {
    const Look& look = looks_[k];
    if (look.is_ahead) continue;
    if (look.turns_heavily) heavy_.push_back(sources_.size());
    sources_.push_back(constraints[k]);
    pairs_.push_back(look.bodies);
    groups_.push_back(look.kind);
    is_idle_.push_back(look.is_idle ? 1 : 0);
  }
  const std::span<const std::uint8_t> colours = colouring_.of(pairs_, bodies.moving());
  counts_.assign(kGroupsAColour * (kColours + 1), 0);
  busy_.assign(counts_.size(), 0);
  for (std::size_t k = 0; k < sources_.size(); ++k) {
    groups_[k] += kGroupsAColour * colours[k];
    if (is_serial(groups_[k])) is_idle_[k] = 0;  // with a block each
    ++counts_[index(groups_[k])];
    busy_[index(groups_[k])] += 1 - is_idle_[k];
  }
}

/// Room for all; from here on `busy_` and `counts_` hold where a group's next one goes: the idle
/// ones after the others.
void ContactBlocks::make_runs(const BodyLines& bodies) {
  const auto blocks_of = [&](std::size_t group) {
    const std::int32_t lanes = is_serial(static_cast<std::int32_t>(group)) ? 1 : kBlockLanes;
    return (counts_[group] + lanes - 1) / lanes;
  };
  used_ = 0;
  for (std::size_t group = 0; group < counts_.size(); ++group) used_ += index(blocks_of(group));
  if (blocks_.size() < used_) blocks_.resize(used_);

  runs_.clear();
  colours_.clear();
  std::int32_t next = 0;
  for (std::size_t group = 0; group < counts_.size(); ++group) {
    if (group % kGroupsAColour == 0 && (colours_.empty() || colours_.back().runs > 0)) {
      colours_.push_back({});
    }
    if (counts_[group] == 0) continue;
    const bool all = is_serial(static_cast<std::int32_t>(group));
    if (colours_.back().runs == 0) colours_.back() = {runs_.size(), 0, 0, all};
    const std::span blocks(blocks_.data() + next, index(blocks_of(group)));
    // Else the last one alone has lanes without a manifold.
    for (ContactBlock& block : all ? blocks : blocks.last(1)) {
      clear(block, bodies.nobody(),
            bodies.waste(static_cast<std::size_t>(&block - blocks_.data())));
    }
    const Kind kind = kKinds[group % kGroupsAColour];
    const auto count = static_cast<std::int32_t>(blocks.size());
    runs_.push_back({blocks.data(), count, kind.points, kind.joint, kind.is_round});
    ++colours_.back().runs;
    colours_.back().blocks += count;
    counts_[group] = next * kBlockLanes + busy_[group];
    busy_[group] = next * kBlockLanes;
    next += count;
  }
}

/// Who goes where.
void ContactBlocks::place() {
  places_.resize(sources_.size());
  for (std::size_t k = 0; k < sources_.size(); ++k) {
    std::int32_t& next = (is_idle_[k] != 0 ? counts_ : busy_)[index(groups_[k])];
    places_[k] = next;
    blocks_[index(next / kBlockLanes)].source[next % kBlockLanes] = static_cast<std::int32_t>(k);
    next += is_serial(groups_[k]) ? kBlockLanes : 1;
  }
}

void ContactBlocks::find_places(Executor& executor, std::span<ContactConstraint* const> constraints,
                                const BodyLines& bodies) {
  look_at_all(executor, constraints, bodies);
  count_groups(constraints, bodies);
  make_runs(bodies);
  place();
}

/// Fetches what filling will read: constraints lie anywhere, and to wait for them takes longer than
/// all else that it does.
void ContactBlocks::expect(const ContactBlock& block, int points) const {
  for (const std::int32_t source : block.source) {
    if (source < 0) continue;
    const ContactConstraint& c = *sources_[index(source)];
    fetch(&c, at(Lines::kPoints + points * kLine, 0));
  }
}
/// Likewise, what its results are put in.
void ContactBlocks::expect_results(const ContactBlock& block, int points) {
  for (const double* const line : block.lines) {
    fetch(line + Lines::kMasses, at(Lines::kPoints - Lines::kMasses + points * kLine, 0));
  }
}

/// Block by block, not constraint by constraint: these are smaller, and less is written elsewhere.
void ContactBlocks::fill(ContactBlock& block, const BlockRun& run, const ContactKernels& kernels,
                         const BodyLines& bodies, double h) {
  const std::int32_t waste = bodies.waste(static_cast<std::size_t>(&block - blocks_.data()));
  alignas(64) Row rest_loads[kBlockPoints];
  bool has_rested = false;
  for (int lane = 0; lane < kBlockLanes; ++lane) {
    if (block.source[lane] < 0) continue;
    ContactConstraint& c = *sources_[index(block.source[lane])];
    block.lines[lane] = c.n.data();
    const std::int32_t a = bodies.line(c.a), b = bodies.line(c.b);
    block.a[lane] = a;
    block.b[lane] = b;
    block.a_out[lane] = bodies.yields(a) ? a : waste;
    block.b_out[lane] = bodies.yields(b) ? b : waste;
    for (int i = 0; i < run.points; ++i) block.yields[i][lane] = i < c.count ? 1 : 0;
    if (!c.has_rested) continue;
    if (!std::exchange(has_rested, true))
      std::ranges::fill(std::span(rest_loads[0], std::size(rest_loads) * kBlockLanes), 0);
    for (int i = 0; i < run.points; ++i) rest_loads[i][lane] = c.rests[index(i)].load;
  }
  kernels.gather(part_of(run, &block, 1), {bodies.responses(), h, give_of(1, h), kPreloadExcess,
                                           has_rested ? rest_loads : nullptr});
}

void ContactBlocks::note_places(const BodyLines& bodies) {
  turning_.clear();
  for (const std::size_t k : heavy_) {
    ContactBlock& block = blocks_[index(places_[k] / kBlockLanes)];
    turning_.push_back({sources_[k], &block, places_[k] % kBlockLanes});
  }
  driven_.clear();
  if (!bodies.has_driven()) return;
  for (std::size_t k = 0; k < sources_.size(); ++k) {
    if (pairs_[k].a >= 0 && pairs_[k].b >= 0) continue;
    const std::int32_t place = places_[k];
    note_driven(index(place / kBlockLanes), place % kBlockLanes, *sources_[k], bodies);
  }
}

void ContactBlocks::note_driven(std::size_t block, int lane, const ContactConstraint& c,
                                const BodyLines& bodies) {
  const std::int32_t a = bodies.line(c.a), b = bodies.line(c.b);
  if (!bodies.is_driven(bodies.is_driven(a) ? a : b)) return;
  Vector arm = centre(c);
  if (bodies.is_driven(b)) arm += c.from_B;
  driven_.push_back({block, lane, bodies.is_driven(a), arm, c.n});
}

void ContactBlocks::follow_driven(const BodyLines& bodies) {
  for (const Driven& d : driven_) {
    ContactBlock& block = blocks_[d.block];
    const std::int32_t a = block.a[d.lane], b = block.b[d.lane];
    set(d.is_A ? block.arm_A : block.arm_B, d.lane,
        d.is_A ? bodies.arm_now(a, b, d.arm, d.n) : bodies.arm_now(b, a, d.arm, d.n));
  }
}

void ContactBlocks::repeat_struck(Executor& executor, const ContactKernels& kernels,
                                  BodyLines& bodies) {
  in_order(executor, [&](const BlockRun& run) {
    for (ContactBlock& block : std::span(run.blocks, index(run.count))) {
      bool is_any_struck = false;
      for (int lane = 0; lane < kBlockLanes; ++lane) {
        const bool is_struck = bodies.is_struck(block.a[lane], block.b[lane]);
        block.part[lane] = is_struck ? 1 : 0;
        is_any_struck |= is_struck;
      }
      if (is_any_struck) {
        kernels.repeat(part_of(run, &block, 1), bodies.velocities());
      }
    }
  });
}

void ContactBlocks::scale_struck(Executor& executor, const ContactKernels& kernels,
                                 std::span<const double> shares, const BodyLines& bodies) {
  in_any_order(executor, [&](const BlockRun& run) {
    for (ContactBlock& block : std::span(run.blocks, index(run.count))) {
      bool is_any_less = false;
      for (int lane = 0; lane < kBlockLanes; ++lane) {
        const bool is_struck = block.source[lane] >= 0 && block.part[lane] != 0;
        block.part[lane] = is_struck ? shares[bodies.island_of(block.a[lane], block.b[lane])] : 1;
        is_any_less |= block.part[lane] != 1;
      }
      if (is_any_less) kernels.scale(part_of(run, &block, 1));
    }
  });
}

}  // namespace cradle
