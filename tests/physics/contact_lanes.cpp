// Contacts side by side: the same bits at every width, and what one contact by itself would do.
#include <catch2/catch.hpp>
#include <limits>
#include <random>

#include "server/collision/index.h"
#include "server/collision/machine_lanes.h"
#include "server/dynamics/contact/contact_blocks.h"
#include "server/dynamics/contact/contact_kernels.h"
#include "server/dynamics/contact/single_contacts.h"
#include "server/dynamics/contact/softness.h"
#include "server/dynamics/contact/turning_contact.h"
#include "server/dynamics/free_flight.h"
#include "tests/physics/flock.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

const SubStep kStep{1.0 / 240, 240, 0.3, 4, softness_of(1.0 / 240, 1.0 / 240)};

/// Balls, bricks, capsules and rods that fall on each other, on the ground and on a platform that
/// moves.
auto heap(int lanes, int ticks) {
  WorldSettings how = settings();
  how.lanes = lanes;
  World world(how);
  add(world, ground());
  BodySpec platform = brick({2, 2, 0.1}, {0, 0, 0.3}, {0.3, 0, 0});
  platform.kind = BodyKind::kinematic;
  add(world, platform);
  std::mt19937_64 random(5);
  for (int i = 0; i < 150; ++i) {
    const Vec3 at{uniform(random, -2, 2), uniform(random, -2, 2), 0.8 + 0.1 * i};
    BodySpec spec = i % 4 == 0 ? ball(0.3, at) : brick({0.3, 0.3, i % 4 == 1 ? 0.3 : 0.1}, at);
    if (i % 4 == 3) spec.shape = Shape::capsule(0.15, 0.4);
    spec.w_WB = {uniform(random, -9, 9), uniform(random, -9, 9), uniform(random, -9, 9)};
    if (i % 7 == 0) spec.material.restitution = 0.5;
    if (i % 5 == 0) spec.material.rolling_friction_m = 0.02;
    if (i % 5 == 1) spec.material.torsional_friction_m = 0.03;
    add(world, spec);
  }
  steps(world, ticks);
  return world.hash();
}

/// Bodies in mid air, with random contacts between them.
struct Tangle {
  std::vector<Vector> x, v, w, inertia, inverse_inertia, acceleration, torque;
  std::vector<Rotation> q;
  std::vector<double> inverse_mass;
  std::vector<Matrix> inverse_inertia_W;
  std::vector<std::int32_t> moving, driven;
  std::vector<ContactConstraint> constraints;

  /// `bodies`, of which the last is driven and the one before it still.
  Tangle(int bodies, int contacts, int points, std::uint64_t seed,
         const Vector& moments = {1, 2, 3})
      : moments_(moments), random(seed) {
    for (int i = 0; i < bodies; ++i) add_body(i, i + 2 < bodies, i + 1 == bodies);
    for (int k = 0; k < contacts; ++k) add_contact(bodies, points);
  }

  /// `domains`: of `moving`; as ContactTick has them.
  BodyLines lines(std::span<const std::int32_t> domains = {}, std::size_t count = 1) {
    BodyLines lines;
    ContactTick now = tick();
    now.domains = domains;
    now.domains_count = count;
    lines.begin(now, arrays(), inverse_inertia_W);
    lines.integrate_velocities(kStep.h, 3);
    return lines;
  }
  BodyArrays arrays() {
    return {x, q, v, w, inverse_mass, inertia, inverse_inertia, acceleration, torque};
  }
  ContactTick tick() { return {1.0 / 60, 1, 5e-4, 0, moving, driven}; }

 private:
  void add_body(int slot, bool yields, bool is_driven) {
    x.push_back(random_vector(random, 1));
    Rotation turn;
    turn.coeffs() << random_vector(random, 1), 1;
    q.push_back(turn.normalized());
    v.push_back(yields || is_driven ? random_vector(random, 3) : Vector::Zero());
    w.push_back(yields || is_driven ? random_vector(random, 9) : Vector::Zero());
    const Vector J = uniform(random, 0.1, 1) * moments_;
    inertia.push_back(J);
    inverse_inertia.push_back(yields ? Vector(J.cwiseInverse()) : Vector::Zero());
    inverse_mass.push_back(yields ? uniform(random, 0.1, 10) : 0);
    acceleration.push_back(Vector::Zero());
    torque.push_back(Vector::Zero());
    const Matrix R = q.back().toRotationMatrix();
    inverse_inertia_W.push_back(R * inverse_inertia.back().asDiagonal() * R.transpose());
    if (yields) moving.push_back(slot);
    if (is_driven) driven.push_back(slot);
  }

  void add_contact(int bodies, int points) {
    const auto a = static_cast<std::int32_t>(random() % static_cast<std::uint64_t>(bodies - 2));
    const auto other = random() % static_cast<std::uint64_t>(bodies - 1);
    add_contact_of(
        a, static_cast<std::int32_t>(other) + (static_cast<std::int32_t>(other) >= a ? 1 : 0),
        points);
  }

 public:
  void make_round(std::int32_t slot) {
    const auto i = static_cast<std::size_t>(slot);
    inertia[i].setConstant(inertia[i].mean());
    inverse_inertia[i] = inertia[i].cwiseInverse();
    inverse_inertia_W[i] = inverse_inertia[i].asDiagonal();
    for (ContactConstraint& c : constraints) find_effective_masses(c);
  }
  void add_contact_of(std::int32_t a, std::int32_t b, int points) {
    Manifold manifold;
    manifold.normal_W = random_vector(random, 1).normalized();
    const Vector t1 = tangent(manifold.normal_W), t2 = manifold.normal_W.cross(t1);
    manifold.count = points;
    const Vector centre = random_vector(random, 1);
    for (int i = 0; i < points; ++i) {
      ContactPoint& p = manifold.points[static_cast<std::size_t>(i)];
      p.p_W = centre + uniform(random, -1, 1) * t1 + uniform(random, -1, 1) * t2;
      p.separation = uniform(random, -0.02, 0.01);
    }
    ContactConstraint c = make_constraint(manifold, a, b, arrays(), inverse_inertia_W);
    c.friction = uniform(random, 0, 1);
    for (const ConstraintPoint& p : c.used()) {
      c.impulse(p).lambda = uniform(random, 0, 0.1);
      c.impulse(p).lambda_t = {uniform(random, -0.01, 0.01), uniform(random, -0.01, 0.01)};
    }
    find_effective_masses(c);
    constraints.push_back(c);
  }

 private:
  Vector moments_;  // by each other
  std::mt19937_64 random;
};

/// Into blocks with the impulses that they have, and back. Returns where they are.
template <class Real>
auto pack(ContactBlocks<Real>& blocks, std::span<ContactConstraint> constraints,
          const BodyLines& bodies) {
  std::vector<ContactConstraint*> all;
  for (ContactConstraint& c : constraints) {
    for (ConstraintPoint& p : c.used()) {
      p.force = c.impulse(p).lambda / kStep.h;
      p.force_t = c.impulse(p).lambda_t / kStep.h;
    }
    look_at(c);
    all.push_back(&c);
  }
  blocks.pack(serial_executor, contact_kernels_of(0).of<Real>(), all, bodies, kStep.h,
              give_of(1, kStep.h));
  return all;
}

template <class Real>
void unpack(ContactBlocks<Real>& blocks, std::span<ContactConstraint* const> all) {
  blocks.unpack(serial_executor, contact_kernels_of(0).of<Real>(), {kStep.h, 1.5, 0.99, 0},
                [](std::size_t, const BlockRun<Real>&) {});
  for (ContactConstraint* c : all)
    for (const ConstraintPoint& p : c->used())
      c->impulse(p) = {kStep.h * p.force_t, kStep.h * p.force};
}

/// A sub-step of them side by side. Returns the separations of the first one's points.
template <class Real = double>
std::array<double, kBlockPoints> advance(std::span<ContactConstraint> constraints,
                                         BodyLines& bodies, const ContactKernels& kernels) {
  const BlockPasses<Real>& passes = kernels.of<Real>();
  ContactBlocks<Real> blocks;
  const auto all = pack(blocks, constraints, bodies);
  for (const auto& run : blocks.runs()) {
    passes.prepare(run, kStep.soft, bodies.velocities());
    passes.warm_start(run, bodies.velocities());
  }
  for (const auto& run : blocks.runs()) passes.solve(run, kStep, bodies.velocities());
  bodies.integrate_positions(kStep.h, 3);
  for (const auto& run : blocks.runs())
    passes.relax(run, kStep, bodies.velocities(), bodies.motions());
  unpack(blocks, all);
  std::array<double, kBlockPoints> separations{};
  std::ranges::transform(blocks.runs()[0].blocks[0].points, separations.begin(),
                         [](const auto& point) { return point.s[0]; });
  return separations;
}

/// How many are in blocks for more points, or for bodies with moments that are not equal.
int escorts_of(Tangle& tangle, const BodyLines& bodies) {
  ContactBlocks<double> blocks;
  const auto all = pack(blocks, std::span(tangle.constraints), bodies);
  int found = 0;
  for (const auto& run : blocks.runs()) {
    for (const auto& block : std::span(run.blocks, index(run.count))) {
      for (int lane = 0; lane < kBlockLanes<double>; ++lane) {
        if (block.source[lane] < 0) continue;
        const int points = all[index(block.source[lane])]->count;
        const bool are_round = bodies.are_round(line_at(block.a[lane]), line_at(block.b[lane]));
        found += run.points > (points == 3 ? 4 : points) || (are_round && !run.is_round) ? 1 : 0;
      }
    }
  }
  return found;
}

}  // namespace

TEST_CASE("a heap falls to the same bits at every width") {
  const auto one = heap(1, 200);
  CHECK(one != heap(1, 199));
  for (const int lanes : machine_lanes()) {
    INFO(lanes << " lanes");
    CHECK(heap(lanes, 200) == one);
  }
}

TEMPLATE_TEST_CASE("a manifold in a block does what its points would do one after another", "",
                   double, float) {
  constexpr double rounding = std::numeric_limits<TestType>::epsilon() / 0x1p-52;
  const int lanes = GENERATE(1, 0);
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    // Where both bodies have equal moments, a block has one number for the inertia of each.
    const Vector moments = seed % 3 == 1 ? Vector(2, 2, 2) : Vector(1, 2, 3);
    Tangle tangle(9, 1, 1 + static_cast<int>(seed / 3 % 4), seed, moments);
    const std::int32_t a = tangle.constraints[0].a, b = tangle.constraints[0].b;
    if (seed % 3 == 2) tangle.make_round(a);
    BodyLines side_by_side = tangle.lines(), one_by_one = tangle.lines();
    const std::int32_t line_a = one_by_one.line(a), line_b = one_by_one.line(b);
    const bool other_is_round = seed % 3 == 1 || !one_by_one.yields(line_b);
    CHECK(one_by_one.are_round(line_a, line_b) == (seed % 3 != 0 && other_is_round));
    tangle.constraints[0].impulses[0].lambda = 0;  // or they would be solved at once
    std::vector<ContactConstraint> alone = tangle.constraints;
    const auto gaps =
        advance<TestType>(tangle.constraints, side_by_side, contact_kernels_of(lanes));
    SingleContact contact(alone[0], one_by_one);
    contact.warm_start();
    contact.solve(kStep);
    one_by_one.integrate_positions(kStep.h, 3);
    contact.relax(kStep);
    for (std::size_t i = 0; i < static_cast<std::size_t>(alone[0].count); ++i) {
      const PointImpulse &p = tangle.constraints[0].impulses[i], &q = alone[0].impulses[i];
      CHECK(gaps[i] == Approx(q.s).margin(1e-13 * rounding));
      CHECK(p.lambda == Approx(q.lambda).margin(1e-12 * rounding));
      CHECK((p.lambda_t - q.lambda_t).norm() < 1e-12 * rounding);
    }
    for (const std::int32_t slot : tangle.moving) {
      const std::int32_t line = side_by_side.line(slot);
      CHECK((side_by_side.v(line) - one_by_one.v(line)).norm() < 1e-11 * rounding);
      CHECK((side_by_side.w(line) - one_by_one.w(line)).norm() < 1e-11 * rounding);
    }
  }
}

TEST_CASE("points that carry together are solved at once") {
  // Against the same linear equations by a dense solver, with the points' responses measured on the
  // bodies: each unit impulse by itself.
  int at_once = 0;
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    const int points = 2 + static_cast<int>(seed % 3);
    Tangle tangle(5, 1, points, seed);
    ContactConstraint& c = tangle.constraints[0];
    for (PointImpulse& own : c.impulses) own.lambda = 5 * (own.lambda + 0.1);
    Eigen::MatrixXd K(points, points);
    const Softness soft = softness_of(kStep.h, kStep.h);
    Eigen::VectorXd rest(points), old(points);
    for (int i = 0; i < points; ++i) {
      const ConstraintPoint& p = c.points[static_cast<std::size_t>(i)];
      BodyLines pushed = tangle.lines(), still = tangle.lines();
      ContactConstraint unit = c;
      SingleContact push(unit, pushed), before(c, still);
      push.add_normal(unit.points[static_cast<std::size_t>(i)], 1);
      for (int j = 0; j < points; ++j) {
        const ConstraintPoint& q = c.points[static_cast<std::size_t>(j)];
        K(j, i) = push.normal_velocity(q) - before.normal_velocity(q);
      }
      const double limit = std::max(kStep.push_speed, -kStep.push_rate * p.s0) +
                           soft.impulse_scale * K(i, i) * c.impulse(p).lambda;
      const double bias = std::max(soft.mass_scale * soft.bias_rate * p.s0, -limit);
      const double vn = before.normal_velocity(p);
      const double give = soft.impulse_scale * K(i, i) * c.impulse(p).lambda / soft.mass_scale;
      rest[i] = vn + give + (p.s0 > 0 ? p.s0 / kStep.h : bias / soft.mass_scale);
      old[i] = c.impulse(p).lambda;
    }
    Eigen::MatrixXd softened = K;
    for (int i = 0; i < points; ++i) {
      softened(i, i) += 1e-6 * K.trace() / points + soft.impulse_scale / soft.mass_scale * K(i, i);
    }
    const Eigen::VectorXd expected = old - softened.partialPivLu().solve(rest);
    if (expected.minCoeff() < 0) continue;
    ++at_once;

    BodyLines bodies = tangle.lines();
    ContactBlocks<double> blocks;
    const auto all = pack(blocks, std::span(&c, 1), bodies);
    for (const auto& run : blocks.runs()) {
      CHECK(run.joint);
      contact_kernels_of(0).doubles.prepare(run, kStep.soft, bodies.velocities());
      contact_kernels_of(0).doubles.solve(run, kStep, bodies.velocities());
    }
    unpack(blocks, all);
    for (int i = 0; i < points; ++i) {
      CHECK(c.impulses[static_cast<std::size_t>(i)].lambda == Approx(expected[i]).epsilon(1e-9));
    }
  }
  CHECK(at_once > 50);
}

TEST_CASE("a manifold that sticks stops at once, one that cannot slides within its cones") {
  int stuck = 0, slid = 0;
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    Tangle tangle(5, 1, 2 + static_cast<int>(seed % 3), seed);
    ContactConstraint& c = tangle.constraints[0];
    const bool is_rough = seed % 2 == 0;
    c.friction = is_rough ? 100 : 0.01;
    tangle.v[static_cast<std::size_t>(c.a)] += 30 * c.n;  // towards B
    BodyLines bodies = tangle.lines();
    advance(tangle.constraints, bodies, contact_kernels_of(0));
    const SingleContact contact(c, bodies);
    double least = 1e9, most = 0;
    for (const ConstraintPoint& p : c.used()) {
      const PointImpulse& own = c.impulse(p);
      CHECK(own.lambda_t.norm() <= c.friction * own.lambda * (1 + 1e-12));
      least = std::min(least, own.lambda);
      most = std::max(most, own.lambda);
    }
    if (least < 0.1 * most) continue;  // a point that carries little may not stick
    for (const ConstraintPoint& p : c.used()) {
      const Vector v = contact.relative_velocity(p);
      const double speed = (v - v.dot(c.n) * c.n).norm();
      if (is_rough) CHECK(speed < 1e-9 * (1 + v.norm()));
      slid += !is_rough && speed > 1;
    }
    stuck += is_rough;
  }
  CHECK(stuck > 30);
  CHECK(slid > 30);
}

TEST_CASE("rolling and torsional friction stop what bodies will turn by, when they will touch") {
  // The contact is that of another attitude, in which a body that tumbles has turn * w of its line.
  // Sliding: all turning against each other stops; sticking: rolling does, and points go on as they
  // were in the tangent plane.
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Tangle tangle(6, 0, 1, seed);
    tangle.add_contact_of(0, seed % 2 == 0 ? 1 : 5, 1);  // of two that yield; of a driven one
    ContactConstraint& c = tangle.constraints[0];
    c.is_ahead = true;
    c.turn_A = tangle.q[2];
    c.turn_B = tangle.q[3];
    const Matrix turned_A = c.turn_A * *c.inverse_inertia_A * c.turn_A.conjugate();
    const Matrix turned_B = c.turn_B * *c.inverse_inertia_B * c.turn_B.conjugate();
    c.inverse_inertia_A = &turned_A;
    c.inverse_inertia_B = &turned_B;
    const bool sticks = seed % 4 < 2;
    c.friction = sticks ? 1e4 : 0;
    c.rolling_m = 1e6;
    c.torsional_m = sticks ? 0 : 1e6;
    c.impulses[0].lambda = 1;
    BodyLines bodies = tangle.lines();
    const auto w = [&](std::int32_t slot, const Rotation& turn) {
      const Vector line = bodies.w(bodies.line(slot));
      return bodies.tumbles(bodies.line(slot)) ? Vector(turn * line) : line;
    };
    const auto slip = [&]() -> Vector {
      return bodies.v(bodies.line(c.b)) + w(c.b, c.turn_B).cross(c.rB(c.points[0])) -
             bodies.v(bodies.line(c.a)) - w(c.a, c.turn_A).cross(c.points[0].rA);
    };
    const Vector before = slip();
    TurningContact turning(c, bodies);
    turning.warm_start(bodies, kStep.h);
    for (int sweep = 0; sweep < 2000; ++sweep) turning.rub(bodies);
    const Vector W = w(c.b, c.turn_B) - w(c.a, c.turn_A), change = slip() - before;
    CAPTURE(seed);
    CHECK((sticks ? Vector(W - W.dot(c.n) * c.n) : W).norm() < 1e-9);
    if (sticks) CHECK((change - change.dot(c.n) * c.n).norm() < 1e-9);
  }
}

TEST_CASE("a body without usable numbers spoils nobody that it does not touch") {
  Tangle tangle(12, 0, 1, 1);
  const std::int32_t still = 10, driven = 11;
  for (std::int32_t slot = 0; slot < 10; ++slot) {
    tangle.add_contact_of(slot, slot % 2 == 0 ? still : driven, 2);
  }
  tangle.v[8].setConstant(std::numeric_limits<double>::quiet_NaN());
  tangle.v[9].setConstant(std::numeric_limits<double>::infinity());
  BodyLines bodies = tangle.lines();
  for (int pass = 0; pass < 2; ++pass) {
    advance(tangle.constraints, bodies, contact_kernels_of(0));
  }
  for (std::int32_t slot = 0; slot < 12; ++slot) {
    const std::int32_t line = bodies.line(slot);
    CHECK((bodies.v(line).allFinite() && bodies.w(line).allFinite()) == (slot != 8 && slot != 9));
  }
}

TEST_CASE("manifolds in one block share no body that yields") {
  Tangle tangle(40, 400, 2, 3);
  const BodyLines bodies = tangle.lines();
  ContactBlocks<double> blocks;
  pack(blocks, std::span(tangle.constraints), bodies);
  std::vector<int> seen(tangle.constraints.size(), 0);
  std::vector<bool> is_touched(bodies.moving(), false);
  for (const auto& run : blocks.runs()) {
    for (const auto& block : std::span(run.blocks, index(run.count))) {
      std::vector<int> touched(bodies.moving(), 0);
      for (int lane = 0; lane < kBlockLanes<double>; ++lane) {
        if (block.source[lane] < 0) continue;
        ++seen[static_cast<std::size_t>(block.source[lane])];
        for (const std::int32_t line : {line_at(block.a[lane]), line_at(block.b[lane])}) {
          if (!bodies.yields(line)) continue;
          ++touched[index(line)];
          is_touched[index(line)] = true;
        }
      }
      for (const int times : touched) CHECK(times <= 1);
    }
  }
  for (const int times : seen) CHECK(times == 1);
  CHECK(std::ranges::count(is_touched, true) == std::ssize(is_touched));
}

TEST_CASE("tasks of one level share no body that yields, and those of domains come first") {
  constexpr int kBodies = 90, kDomains = 5;
  Tangle tangle(kBodies, 600, 2, 4);
  std::vector<std::int32_t> domains;
  for (std::size_t k = 0; k < tangle.moving.size(); ++k) {
    domains.push_back(static_cast<std::int32_t>(k * kDomains / tangle.moving.size()));
  }
  const BodyLines bodies = tangle.lines(domains, kDomains);
  ContactBlocks<double> blocks;
  pack(blocks, std::span(tangle.constraints), bodies);
  const TaskTree& tree = bodies.tasks();
  REQUIRE(tree.levels() == 4);
  std::int32_t last = 0;
  std::size_t seen = 0, between = 0;
  std::vector<bool> is_touched(bodies.moving(), false);
  for (std::size_t level = 0; level < tree.levels(); ++level) {
    std::vector<std::int32_t> task_of_line(bodies.moving(), -1);
    for (const auto& run : blocks.runs()) {
      if (run.task < tree.begin(level) || run.task >= tree.end(level)) continue;
      CHECK(run.task >= last);
      last = run.task;
      for (const auto& block : std::span(run.blocks, index(run.count))) {
        for (int lane = 0; lane < kBlockLanes<double>; ++lane) {
          if (block.source[lane] < 0) continue;
          ++seen;
          between += level > 0 ? 1 : 0;
          for (const std::int32_t line : {line_at(block.a[lane]), line_at(block.b[lane])}) {
            if (!bodies.yields(line)) continue;
            is_touched[index(line)] = true;
            std::int32_t& task = task_of_line[static_cast<std::size_t>(line)];
            CHECK((task < 0 || task == run.task));
            task = run.task;
          }
        }
      }
    }
  }
  CHECK(seen == tangle.constraints.size());
  CHECK(std::ranges::count(is_touched, true) == std::ssize(is_touched));
  CHECK(between > 100);
}

TEST_CASE("a contact does the same to the bit alone, and in a block with contacts of other kinds") {
  int escorted = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    // In pairs, so that all are of one colour; some of balls, some that all carry or none.
    const int pairs = 20 + static_cast<int>(seed);
    Tangle tangle(2 * pairs + 2, 0, 0, seed);
    for (std::int32_t k = 0; k < pairs; ++k) {
      if (k % 3 != 0) tangle.make_round(2 * k), tangle.make_round(2 * k + 1);
      tangle.add_contact_of(2 * k, 2 * k + 1, 1 + (k / 3) % 4);
      ContactConstraint& c = tangle.constraints.back();
      for (ConstraintPoint& p : c.used()) c.impulse(p).lambda *= k % 5 == 0 ? 0 : 1;
      if (k % 2 == 0 && c.count > 1) c.impulse(c.points[0]).lambda = 0;
    }
    const Tangle before = tangle;
    BodyLines together = tangle.lines();
    escorted += escorts_of(tangle, together);
    advance(tangle.constraints, together, contact_kernels_of(0));
    for (std::size_t k = 0; k < tangle.constraints.size(); ++k) {
      Tangle alone = before;
      ContactConstraint& c = alone.constraints[k];
      BodyLines by_itself = alone.lines();
      advance(std::span(&c, 1), by_itself, contact_kernels_of(0));
      for (const std::int32_t slot : {c.a, c.b}) {
        CAPTURE(seed, slot);
        const std::int32_t line = together.line(slot);
        CHECK(together.v(line) == by_itself.v(line));
        CHECK(together.w(line) == by_itself.w(line));
      }
    }
  }
  CHECK(escorted > 200);
}

}  // namespace cradle
