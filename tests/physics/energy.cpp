// Contacts give no energy: in a closed scene with e <= 1 there is never more than at its start.
#include <catch2/catch.hpp>
#include <random>
#include <vector>

#include "server/dynamics/contact/contact_solver.h"
#include "tests/physics/worlds.h"

namespace cradle {
namespace {

double uniform_between(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

/// Cubes of 1 m in a wall, face to face, without loads; outside of any world.
struct BallWall {
  explicit BallWall(int side, std::uint64_t seed) : random(seed) {
    for (int i = 0; i < side * side; ++i) {
      x.emplace_back(i % side, 0, i / side);
      moving.push_back(i);
    }
    v = w = acceleration = torque = std::vector<Vector>(x.size(), Vector::Zero());
    q.assign(x.size(), Rotation::Identity());
    inertia.assign(x.size(), Vector::Constant(1.0 / 6));
    inverse_inertia.assign(x.size(), Vector::Constant(6));
    inverse_mass.assign(x.size(), 1);
    inverse_inertia_W.assign(x.size(), 6 * Matrix::Identity());
    for (std::int32_t i = 0; i < side * side; ++i) {
      if (i % side > 0) join(i - 1, i, Vector::UnitX(), Vector::UnitZ());
      if (i >= side) join(i - side, i, Vector::UnitZ(), Vector::UnitX());
    }
  }
  void join(std::int32_t a, std::int32_t b, const Vector& n, const Vector& across) {
    Manifold manifold;
    manifold.normal_W = n;
    const Vector middle = (x[static_cast<std::size_t>(a)] + x[static_cast<std::size_t>(b)]) / 2;
    for (const double along : {-0.5, 0.5}) {
      for (const double aside : {-0.5, 0.5}) {
        const auto k = static_cast<std::size_t>(manifold.count++);
        manifold.points[k].separation = 0;
        manifold.points[k].p_W = middle + along * across + aside * Vector::UnitY();
      }
    }
    contacts.push_back(make_constraint(manifold, a, b, arrays(), inverse_inertia_W));
    contacts.back().friction = 0.5;
    for (ConstraintPoint& p : contacts.back().used()) {
      p.force = uniform_between(random, 0, 1000);
      p.force_t = Eigen::Vector2d::Constant(0.3 * p.force);
    }
    look_at(contacts.back());
  }
  BodyArrays arrays() {
    return {x, q, v, w, inverse_mass, inertia, inverse_inertia, acceleration, torque};
  }
  double energy() const {
    double sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      sum += 0.5 * v[i].squaredNorm() + 0.5 / 6 * w[i].squaredNorm();
    }
    return sum;
  }
  void step(int sub_steps) {
    std::vector<ContactConstraint*> all;
    for (ContactConstraint& c : contacts) all.push_back(&c);
    make_contact_solver("soft")->advance({1.0 / 60, sub_steps, 5e-4, 0, moving, {}}, arrays(),
                                         inverse_inertia_W, all);
  }

  std::mt19937_64 random;
  std::vector<Vector> x, v, w, inertia, inverse_inertia, acceleration, torque;
  std::vector<Rotation> q;
  std::vector<double> inverse_mass;
  std::vector<Matrix> inverse_inertia_W;
  std::vector<std::int32_t> moving;
  std::vector<ContactConstraint> contacts;
};

}  // namespace

TEST_CASE("energy: forces that contacts remember set nothing in motion") {
  for (const int sub_steps : {1, 4, 8}) {
    BallWall wall(6, 1);
    wall.step(sub_steps);
    CHECK(wall.energy() < 1e-20);
  }
}

TEST_CASE("energy: a blow that contacts remember gives nothing to a wall that moves") {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    for (const int sub_steps : {1, 4, 8}) {
      BallWall wall(6, seed);
      for (std::size_t i = 0; i < wall.x.size(); ++i) {
        for (int k = 0; k < 3; ++k) wall.v[i][k] = uniform_between(wall.random, -3, 3);
      }
      const double before = wall.energy();
      wall.step(sub_steps);
      INFO(seed << ", " << sub_steps << ": " << wall.energy() << " of " << before);
      CHECK(wall.energy() <= before);
    }
  }
}

TEST_CASE("energy: bricks that fall upon each other gain nothing but what overlaps give back") {
  // Each heap falls in its own way: of twenty one may gain more in some tick,
  // where a thin brick that spins is pushed out with the arms that it had at the tick's start.
  int heaps = 0, above = 0;
  double most = 0;
  for (const auto& [rate_hz, sub_steps] : {std::pair{60.0, 0}, {60.0, 8}, {240.0, 0}, {240.0, 4}}) {
    for (int seed = 0; seed < 100; ++seed) {
      WorldSettings how = settings(rate_hz);
      how.sub_steps = sub_steps;
      World world(how);
      add(world, ground());
      for (int i = 0; i < 40; ++i) {
        const Vec3 at{0.07 * (i % 7) + 1e-4 * seed, 0.05 * (i % 5), 0.3 + 0.45 * i};
        add(world, brick({0.3, 0.2, 0.1 + 0.002 * i}, at));
      }
      const double start = energy(world);
      double before = start, worst = 0;
      for (int k = 0; k < 2 * rate_hz; ++k) {
        world.step();
        worst = std::max(worst, energy(world) - before);
        before = energy(world);
      }
      ++heaps;
      above += worst > 5e-4 * start ? 1 : 0;
      most = std::max(most, worst / start);
    }
  }
  CAPTURE(above, most);
  CHECK(above * 20 <= heaps);
  CHECK(most < 4e-3);
}

namespace {

enum class Kind { ball, box, capsule, all };

/// Two dozen bodies that fly about in a room.
void add_crowd(World& world, Kind kind, const Material& material, std::uint64_t seed) {
  const double half = 3;
  for (const double sign : {-1.0, 1.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      Vector at = Vector::Zero(), size = Vector::Constant(half + 1);
      at[axis] = sign * half;
      size[axis] = 1;
      BodySpec wall = brick({size.x(), size.y(), size.z()}, {at.x(), at.y(), at.z()});
      wall.kind = BodyKind::fixed;
      wall.material = material;
      add(world, wall);
    }
  }
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto size = [&] { return uniform_between(random, 0.15, 0.25); };
  const auto any = [&] {
    return Vec3{uniform_between(random, -5, 5), uniform_between(random, -5, 5),
                uniform_between(random, -5, 5)};
  };
  for (int k = 0; k < 24; ++k) {
    const Vec3 at{-1.2 + 0.8 * (k % 4), -1.2 + 0.8 * (k / 4 % 3), -1.5 + 0.9 * (k / 12)};
    const Kind one = kind == Kind::all ? static_cast<Kind>(k % 3) : kind;
    BodySpec spec = brick({size(), size(), size()}, at, any());
    if (one == Kind::ball) spec.shape = Shape::sphere(size());
    if (one == Kind::capsule) spec.shape = Shape::capsule(0.7 * size(), size());
    const Rotation q =
        Rotation(normal(random), normal(random), normal(random), normal(random)).normalized();
    spec.q_WB = {q.w(), q.x(), q.y(), q.z()};
    spec.w_WB = any();
    spec.mass_kg = uniform_between(random, 1, 2);
    spec.material = material;
    add(world, spec);
  }
}

/// How far above its start the energy gets, by its start above the lowest that bodies can be.
double most_above_start(World& world, double seconds) {
  const double floor = -24 * 2 * kGravity * 2, start = energy(world);
  double most = 0;
  for (int k = 0; k < seconds * world.settings().rate_hz; ++k) {
    world.step();
    most = std::max(most, energy(world) - start);
  }
  return most / (start - floor);
}

}  // namespace

TEST_CASE("energy: a closed room never has more than at its start") {
  for (const Kind kind : {Kind::ball, Kind::box, Kind::capsule, Kind::all}) {
    for (const double rate_hz : {60.0, 240.0}) {
      for (const double restitution : {0.0, 0.5, 1.0}) {
        for (const double friction : {0.0, 0.5}) {
          for (std::uint64_t seed = 0; seed < 3; ++seed) {
            CAPTURE(static_cast<int>(kind), rate_hz, restitution, friction, seed);
            World world(settings(rate_hz));
            Material material;
            material.friction = friction;
            material.restitution = restitution;
            add_crowd(world, kind, material, seed);
            CHECK(most_above_start(world, 4) < 1e-6);
          }
        }
      }
    }
  }
}

TEST_CASE("energy: what bounces for ever on edges and corners gains none") {
  for (int k = 0; k < 81; ++k) {
    CAPTURE(k);
    World world(settings());
    BodySpec floor = ground(0);
    floor.material.restitution = 1;
    add(world, floor);
    BodySpec box = brick({0.5, k % 2 == 0 ? 0.3 : 0.5, k % 3 == 0 ? 0.2 : 0.5}, {0, 0, 4});
    box.material = floor.material;
    std::mt19937_64 random(static_cast<std::uint64_t>(k));
    std::normal_distribution<double> normal;
    const Rotation q =
        Rotation(normal(random), normal(random), normal(random), normal(random)).normalized();
    box.q_WB = {q.w(), q.x(), q.y(), q.z()};
    add(world, box);
    const double start = energy(world);
    double most = 0;
    for (int i = 0; i < 600; ++i) {
      world.step();
      most = std::max(most, energy(world) - start);
    }
    CHECK(most < 1e-6 * start);
  }
}

}  // namespace cradle
