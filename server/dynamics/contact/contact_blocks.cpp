#include "server/dynamics/contact/contact_blocks.h"

#include <algorithm>
#include <cstddef>
#include <type_traits>
#include <utility>

#include "server/collision/index.h"
#include "server/dynamics/contact/softness.h"

namespace cradle {
namespace {

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
static_assert(sizeof(ConstraintPoint) == at(kLineNumbers, 0));
static_assert(offsetof(ConstraintPoint, rA) == at(0, 0));
static_assert(offsetof(ConstraintPoint, s0) == at(0, 3));
static_assert(offsetof(ConstraintPoint, force_t) == at(Lines::kLoad, 0));
static_assert(offsetof(ConstraintPoint, force) == at(Lines::kLoad, 2));
static_assert(offsetof(ConstraintPoint, press) == at(Lines::kLoad, 3));

template <class Row>
void set(Row* rows, int lane, const Vector& value) {
  using Real = std::remove_extent_t<Row>;
  for (int k = 0; k < 3; ++k) rows[k][lane] = static_cast<Real>(value[k]);
}

/// The mean of the points: between them every point has a short lever. As an arm of A.
Vector centre(const ContactConstraint& c) {
  Vector sum = Vector::Zero();
  for (const ConstraintPoint& p : c.used()) sum += p.rA;
  return sum / static_cast<double>(c.count);
}

/// Of no constraint. Nobody writes to it.
alignas(64) double no_lines[ConstraintLines::kPoints + kBlockPoints * kLineNumbers]{};

/// Lanes without a manifold do nothing to nobody.
template <class Real>
void clear(ContactBlock<Real>& block, std::int32_t nobody, std::int32_t waste) {
  constexpr int lanes = kBlockLanes<Real>;
  std::fill_n(block.lines, lanes, &no_lines[0]);
  std::fill_n(block.a, lanes, begin_of(nobody));
  std::fill_n(block.b, lanes, begin_of(nobody));
  std::fill_n(block.a_out, lanes, begin_of(waste));
  std::fill_n(block.b_out, lanes, begin_of(waste));
  std::fill_n(block.source, lanes, -1);
  for (auto& point : block.points) std::fill_n(point.yields, lanes, 0);
}

}  // namespace

template <class Real>
void ContactBlocks<Real>::make_runs() {
  used_ = plan_.blocks();
  if (blocks_.size() < used_) blocks_.resize(used_);
  runs_.clear();
  for (const PlannedRun& run : plan_.runs()) {
    runs_.push_back({blocks_.data() + run.first, run.count, run.kind.points, run.kind.joint,
                     run.kind.is_round, run.task});
  }
}

/// Fetches what filling will read: constraints lie anywhere, and to wait for them takes longer than
/// all else that it does.
template <class Real>
void ContactBlocks<Real>::expect(std::size_t block, int points) const {
  for (const std::int32_t source : plan_.lanes(block)) {
    if (source < 0) continue;
    const ContactConstraint& c = *plan_.sources()[index(source)];
    fetch(&c, at(Lines::kPoints + points * kLineNumbers, 0));
  }
}
/// Likewise, what its results are put in.
template <class Real>
void ContactBlocks<Real>::expect_results(const Block& block, int points) {
  for (const double* const line : block.lines) {
    fetch(line + Lines::kMasses, at(Lines::kPoints - Lines::kMasses + points * kLineNumbers, 0));
  }
}

/// Block by block, not constraint by constraint: these are smaller, and less is written elsewhere.
template <class Real>
void ContactBlocks<Real>::fill(Block& block, const Run& run, const Passes& passes,
                               const BodyLines& bodies, double h, double give) {
  const std::int32_t waste = bodies.waste(run.task);
  const std::span<const std::int32_t> sources = plan_.lanes(number_of(block));
  if (std::ranges::find(sources, -1) != sources.end()) clear(block, bodies.nobody(), waste);
  std::ranges::copy(sources, block.source);
  alignas(64) typename Block::Row rest_loads[kBlockPoints];
  bool has_rested = false;
  for (int lane = 0; lane < Block::kLanes; ++lane) {
    if (block.source[lane] < 0) continue;
    ContactConstraint& c = *plan_.sources()[index(block.source[lane])];
    block.lines[lane] = c.n.data();
    const std::int32_t a = bodies.line(c.a), b = bodies.line(c.b);
    block.a[lane] = begin_of(a);
    block.b[lane] = begin_of(b);
    block.a_out[lane] = begin_of(bodies.yields(a) ? a : waste);
    block.b_out[lane] = begin_of(bodies.yields(b) ? b : waste);
    for (int i = 0; i < run.points; ++i) block.points[i].yields[lane] = i < c.count ? 1 : 0;
    if (!c.has_rested) continue;
    if (!std::exchange(has_rested, true))
      std::ranges::fill(std::span(rest_loads[0], std::size(rest_loads) * Block::kLanes), 0);
    for (int i = 0; i < run.points; ++i)
      rest_loads[i][lane] = static_cast<Real>(c.rests[index(i)].load);
  }
  passes.gather(part_of(run, &block, 1),
                {bodies.responses(), h, give, kPreloadExcess, has_rested ? rest_loads : nullptr});
}

template <class Real>
void ContactBlocks<Real>::note_places(const BodyLines& bodies) {
  turning_.clear();
  const std::span<const std::int32_t> places = plan_.places();
  for (const std::int32_t k : plan_.heavy()) {
    const std::int32_t place = places[index(k)];
    turning_.push_back(
        {plan_.sources()[index(k)], &blocks_[index(place / Block::kLanes)], place % Block::kLanes});
  }
  driven_.clear();
  if (!bodies.has_driven()) return;
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (plan_.pairs()[k].a >= 0 && plan_.pairs()[k].b >= 0) continue;
    note_driven(index(places[k] / Block::kLanes), places[k] % Block::kLanes, *plan_.sources()[k],
                bodies);
  }
}

template <class Real>
void ContactBlocks<Real>::note_driven(std::size_t block, int lane, const ContactConstraint& c,
                                      const BodyLines& bodies) {
  const std::int32_t a = bodies.line(c.a), b = bodies.line(c.b);
  if (!bodies.is_driven(bodies.is_driven(a) ? a : b)) return;
  Vector arm = centre(c);
  if (bodies.is_driven(b)) arm += c.from_B;
  driven_.push_back({block, lane, bodies.is_driven(a), arm, c.n});
}

template <class Real>
void ContactBlocks<Real>::follow_driven(const BodyLines& bodies) {
  for (const Driven& d : driven_) {
    Block& block = blocks_[d.block];
    const std::int32_t a = line_at(block.a[d.lane]), b = line_at(block.b[d.lane]);
    set(d.is_A ? block.arm_A : block.arm_B, d.lane,
        d.is_A ? bodies.arm_now(a, b, d.arm, d.n) : bodies.arm_now(b, a, d.arm, d.n));
  }
}

template <class Real>
void ContactBlocks<Real>::repeat_struck(Executor& executor, const Passes& passes,
                                        BodyLines& bodies) {
  in_order(executor, [&](const Run& run) {
    for (Block& block : std::span(run.blocks, index(run.count))) {
      bool is_any_struck = false;
      for (int lane = 0; lane < Block::kLanes; ++lane) {
        const bool is_struck = bodies.is_struck(line_at(block.a[lane]), line_at(block.b[lane]));
        block.part[lane] = is_struck ? 1 : 0;
        is_any_struck |= is_struck;
      }
      if (is_any_struck) {
        passes.repeat(part_of(run, &block, 1), bodies.velocities());
      }
    }
  });
}

template <class Real>
void ContactBlocks<Real>::scale_struck(Executor& executor, const Passes& passes,
                                       std::span<const double> shares, const BodyLines& bodies) {
  in_any_order(executor, [&](const Run& run) {
    for (Block& block : std::span(run.blocks, index(run.count))) {
      bool is_any_less = false;
      for (int lane = 0; lane < Block::kLanes; ++lane) {
        const bool is_struck = block.source[lane] >= 0 && block.part[lane] != 0;
        const double share =
            is_struck ? shares[bodies.island_of(line_at(block.a[lane]), line_at(block.b[lane]))]
                      : 1;
        block.part[lane] = static_cast<Real>(share);
        is_any_less |= block.part[lane] != 1;
      }
      if (is_any_less) passes.scale(part_of(run, &block, 1));
    }
  });
}

template class ContactBlocks<double>;
template class ContactBlocks<float>;

}  // namespace cradle
