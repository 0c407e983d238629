#include "server/dynamics/contact/contact_blocks.h"

#include <algorithm>

#include "server/dynamics/contact/softness.h"

namespace cradle {
namespace {

/// What a block's manifolds have in common.
struct Kind {
  int points;
  bool joint;
};
constexpr Kind kKinds[] = {{1, false}, {2, false}, {4, false}, {2, true}, {4, true}};
constexpr int kLooksWorthAThread = 128;  // of some nanoseconds
constexpr std::int32_t kGroupsAColour = kBlockKinds;
static_assert(std::size(kKinds) == kBlockKinds);

/// Points that all carried last tick, or are all new, are likely to carry together: they are solved
/// at once, which also keeps a symmetric stack symmetric.
std::int32_t kind_of(const ContactConstraint& c) {
  if (c.count == 1) return 0;
  const bool joint = c.carrying == 0 || c.carrying == c.count;
  return (c.count == 2 ? 1 : 2) + (joint ? 2 : 0);
}

std::size_t index(std::int32_t i) { return static_cast<std::size_t>(i); }

using Row = ContactBlock::Row;

void set(Row* rows, int lane, const Vector& value) {
  for (int k = 0; k < 3; ++k) rows[k][lane] = value[k];
}

void set(Row* rows, int lane, const Matrix& m) {
  rows[0][lane] = m(0, 0);
  rows[1][lane] = m(0, 1);
  rows[2][lane] = m(0, 2);
  rows[3][lane] = m(1, 1);
  rows[4][lane] = m(1, 2);
  rows[5][lane] = m(2, 2);
}

/// The mean of the points: between them every point has a short lever. As an arm of A.
Vector centre(const ContactConstraint& c) {
  Vector sum = Vector::Zero();
  for (const ConstraintPoint& p : c.used()) sum += p.rA;
  return sum / c.count;
}

/// Lanes without a manifold do nothing to nobody.
void clear(ContactBlock& block, std::int32_t nobody, std::int32_t waste) {
  block = ContactBlock{};
  std::fill_n(block.mass_scale, kBlockLanes, 1);
  std::fill_n(block.a, kBlockLanes, nobody);
  std::fill_n(block.b, kBlockLanes, nobody);
  std::fill_n(block.a_out, kBlockLanes, waste);
  std::fill_n(block.b_out, kBlockLanes, waste);
  std::fill_n(block.source, kBlockLanes, -1);
}

void fill_lane(ContactBlock& block, int lane, const ContactConstraint& c, const Softness& soft,
               double h, const BodyLines& bodies, std::int32_t waste) {
  const std::int32_t a = bodies.line(c.a), b = bodies.line(c.b);
  block.a[lane] = a;
  block.b[lane] = b;
  block.a_out[lane] = bodies.yields(a) ? a : waste;
  block.b_out[lane] = bodies.yields(b) ? b : waste;
  const Vector arm_A = centre(c);
  set(block.n, lane, c.n);
  set(block.t1, lane, c.t1);
  const Vector arm_B = arm_A + c.from_B;
  set(block.arm_A, lane, arm_A);
  set(block.arm_B, lane, arm_B);
  set(block.inverse_inertia_A, lane, *c.inverse_inertia_A);
  set(block.inverse_inertia_B, lane, *c.inverse_inertia_B);
  block.inverse_mass_A[lane] = c.inverse_mass_A;
  block.inverse_mass_B[lane] = c.inverse_mass_B;
  block.friction[lane] = c.friction;
  block.mass_scale[lane] = soft.mass_scale;
  block.impulse_scale[lane] = soft.impulse_scale;
  block.bias_rate[lane] = soft.bias_rate;
  block.gap_haste[lane] = c.restitution > 0 ? kImpactHaste : 1;
  for (std::size_t i = 0; i < static_cast<std::size_t>(c.count); ++i) {
    const ConstraintPoint& p = c.points[i];
    const Vector from_centre = p.rA - arm_A;
    block.u[i][lane] = c.t1.dot(from_centre);
    block.v[i][lane] = c.t2.dot(from_centre);
    block.s0[i][lane] = block.s[i][lane] = p.s0;
    block.yields[i][lane] = 1;
    block.lambda[i][lane] = h * p.force;
    block.lambda_1[i][lane] = h * p.force_t.x();
    block.lambda_2[i][lane] = h * p.force_t.y();
  }
  if (c.count != 3) return;
  for (Row* row : {&block.u[3], &block.v[3], &block.s0[3], &block.s[3], &block.yields[3],
                   &block.lambda[3], &block.lambda_1[3], &block.lambda_2[3]}) {
    (*row)[lane] = 0;
  }
}

}  // namespace

/// Of each by itself, what the others are not asked for.
void ContactBlocks::look_at_all(Executor& executor, std::span<ContactConstraint* const> constraints,
                                const BodyLines& bodies) {
  const auto body = [&](std::int32_t slot) {
    const std::int32_t line = bodies.line(slot);
    return bodies.yields(line) ? line : -1;
  };
  looks_.resize(constraints.size());
  for_each_index(executor, constraints.size(), kLooksWorthAThread, [&](std::size_t k) {
    const ContactConstraint& c = *constraints[k];
    looks_[k] = {{body(c.a), body(c.b)}, kind_of(c), c.is_ahead, c.turns_heavily()};
  });
}

void ContactBlocks::count_groups(std::span<ContactConstraint* const> constraints,
                                 const BodyLines& bodies) {
  pairs_.clear();
  sources_.clear();
  heavy_.clear();
  groups_.clear();
  for (std::size_t k = 0; k < constraints.size(); ++k) {
    const Look& look = looks_[k];
    if (look.is_ahead) continue;
    if (look.turns_heavily) heavy_.push_back(sources_.size());
    sources_.push_back(constraints[k]);
    pairs_.push_back(look.bodies);
    groups_.push_back(look.kind);
  }
  const std::span<const std::uint8_t> colours = colouring_.of(pairs_, bodies.moving());
  counts_.assign(kGroupsAColour * (kColours + 1), 0);
  for (std::size_t k = 0; k < sources_.size(); ++k) {
    groups_[k] += kGroupsAColour * colours[k];
    ++counts_[index(groups_[k])];
  }
}

/// Room for all; from here on `counts_` holds where a group's next one goes.
void ContactBlocks::make_runs(const BodyLines& bodies) {
  const auto is_serial = [](std::size_t group) { return group >= kGroupsAColour * kColours; };
  const auto blocks_of = [&](std::size_t group) {
    const std::int32_t lanes = is_serial(group) ? 1 : kBlockLanes;
    return (counts_[group] + lanes - 1) / lanes;
  };
  used_ = 0;
  for (std::size_t group = 0; group < counts_.size(); ++group) used_ += index(blocks_of(group));
  if (blocks_.size() < used_) blocks_.resize(used_ + used_ / 4);

  runs_.clear();
  colours_.clear();
  std::int32_t next = 0;
  for (std::size_t group = 0; group < counts_.size(); ++group) {
    if (group % kGroupsAColour == 0 && (colours_.empty() || colours_.back().runs > 0)) {
      colours_.push_back({});
    }
    if (counts_[group] == 0) continue;
    if (colours_.back().runs == 0) colours_.back() = {runs_.size(), 0, 0, is_serial(group)};
    const std::span blocks(blocks_.data() + next, index(blocks_of(group)));
    const bool all = is_serial(group);  // else the last one alone has lanes without a manifold
    for (ContactBlock& block : all ? blocks : blocks.last(1)) {
      clear(block, bodies.nobody(),
            bodies.waste(static_cast<std::size_t>(&block - blocks_.data())));
    }
    const Kind kind = kKinds[group % kGroupsAColour];
    const auto count = static_cast<std::int32_t>(blocks.size());
    runs_.push_back({blocks.data(), count, kind.points, kind.joint});
    ++colours_.back().runs;
    colours_.back().blocks += count;
    counts_[group] = next * kBlockLanes;
    next += count;
  }
}

/// Who goes where.
void ContactBlocks::place() {
  places_.resize(sources_.size());
  for (std::size_t k = 0; k < sources_.size(); ++k) {
    std::int32_t& next = counts_[index(groups_[k])];
    places_[k] = next;
    blocks_[index(next / kBlockLanes)].source[next % kBlockLanes] = static_cast<std::int32_t>(k);
    next += groups_[k] >= kGroupsAColour * kColours ? kBlockLanes : 1;
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
  constexpr std::size_t kLine = 64;
  for (const std::int32_t source : block.source) {
    if (source < 0) continue;
    const ContactConstraint& c = *sources_[index(source)];
    const auto* const begin = reinterpret_cast<const char*>(&c);
    const auto* const end = reinterpret_cast<const char*>(&c.points[0] + points);
    for (const char* line = begin; line < end; line += kLine) __builtin_prefetch(line);
  }
}

/// Block by block, not constraint by constraint: these are smaller, and less is written elsewhere.
void ContactBlocks::fill(ContactBlock& block, const BodyLines& bodies, double h) {
  const std::int32_t waste = bodies.waste(static_cast<std::size_t>(&block - blocks_.data()));
  const Softness common = softness_of(1, h);
  for (int lane = 0; lane < kBlockLanes; ++lane) {
    if (block.source[lane] < 0) continue;
    const ContactConstraint& c = *sources_[index(block.source[lane])];
    const Softness soft = c.stiffness == 1 ? common : softness_of(c.stiffness, h);
    fill_lane(block, lane, c, soft, h, bodies, waste);
  }
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
        kernels.repeat({&block, 1, run.points, run.joint}, bodies.velocities());
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
      if (is_any_less) kernels.scale({&block, 1, run.points, run.joint});
    }
  });
}

void ContactBlocks::take_results(const ContactBlock& block, int lane, double h,
                                 ContactConstraint& c) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(c.count); ++i) {
    ConstraintPoint& p = c.points[i];
    p.s = block.s[i][lane];
    p.force = block.lambda[i][lane] / h;
    p.force_t = {block.lambda_1[i][lane] / h, block.lambda_2[i][lane] / h};
    p.K_normal = 1 / block.yields[i][lane];
  }
}

}  // namespace cradle
