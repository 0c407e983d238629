// The benchmark's own search for the least overlap, against closed forms and the best of all axes.
#include "tests/bench/pair.h"
#include "tests/bench/parting.h"
#include "tests/unit/collision_pairs.h"

using namespace cradle;
using bench::parting;

TEST_CASE("parting: spheres and capsules part as their centre lines say") {
  Random random;
  for (int trial = 0; trial < 1000; ++trial) {
    CAPTURE(trial);
    const Pair balls = random.pair(ShapeKind::sphere, ShapeKind::sphere);
    const Vector between = balls.X_WB.x - balls.X_WA.x;
    CHECK(
        parting(balls).overlap ==
        Approx(balls.A.shape.radius_m() + balls.B.shape.radius_m() - between.norm()).margin(1e-9));
  }
  const Solid capsule = Shape::capsule(0.2, 0.5);
  const Parting crossed = parting(
      {capsule, capsule, {}, {{0.37, 0.1, 0.2}, Eigen::AngleAxisd(1, Vector::UnitX()).matrix()}});
  CHECK(crossed.overlap == Approx(0.03).margin(1e-12));
  CHECK((crossed.n - Vector::UnitX()).norm() < 1e-6);
}

TEST_CASE("parting: a cylinder overlaps as much as the prism within it, and hardly more") {
  // Of the prism all axes are tried, of the cylinder the best is searched for.
  Random random;
  std::vector<Vector> rims;
  for (int k = 0; k < 48; ++k) {
    const double angle = 2 * 3.14159265358979323846 * k / 48;
    for (const double z : {-0.5, 0.5})
      rims.emplace_back(0.4 * std::cos(angle), 0.4 * std::sin(angle), z);
  }
  const Solid prism(make_hull(rims).geometry), cylinder = Shape::cylinder(0.4, 0.5);
  const double between = 0.4 * (1 - std::cos(3.14159265358979323846 / 48));
  for (int trial = 0; trial < 300; ++trial) {
    CAPTURE(trial);
    Pair pair{prism,
              Shape::box({0.5, 0.4, 0.3}),
              {Vector::Zero(), random.rotation()},
              {Vector::Zero(), random.rotation()}};
    pair.X_WB.x = 2 * random.direction();
    const Parting apart = parting(pair);
    pair.X_WB.x += apart.n * (apart.overlap - 0.01);
    const double of_prism = parting(pair).overlap;
    pair.A = cylinder;
    const double of_cylinder = parting(pair).overlap;
    CHECK(of_cylinder > of_prism - 1e-9);
    CHECK(of_cylinder < of_prism + 1.5 * between);
  }
}

TEST_CASE("parting: no direction overlaps less, and parting along it leaves bodies touching") {
  Random random;
  for (const auto& [kind_A, kind_B] : colliding_kinds()) {
    CAPTURE(word_of(kind_A), word_of(kind_B));
    for (int trial = 0; trial < 40; ++trial) {
      CAPTURE(trial);
      Pair pair = random.pair(kind_A, kind_B, 0.2);
      const Parting best = parting(pair);
      REQUIRE(std::abs(best.n.norm() - 1) < 1e-12);
      REQUIRE(std::abs(best.overlap - overlap(pair, best.n)) < 1e-6);
      if (pair.has(ShapeKind::half_space)) continue;
      for (int k = 0; k < 100; ++k)
        REQUIRE(overlap(pair, random.direction()) > best.overlap - 1e-9);
      pair.X_WB.x += best.n * best.overlap;
      REQUIRE(std::abs(parting(pair).overlap) < 1e-6);
    }
  }
}

TEST_CASE("a row of the pair bench has the figures of its own contacts, and FCL's") {
  const auto named = [](std::string_view name) {
    return *std::ranges::find(bench::pair_cases(), name, &bench::PairCase::name);
  };
  CHECK(bench::pair_cases().size() == 54);
  const auto rows = run(named("pair:sphere-half_space"));
  REQUIRE(rows.size() == 4);
  for (const bench::PairRow& row : rows) {
    CHECK(row.ours.ns > 0);
    CHECK(row.ours.points == 1);
    CHECK(row.ours.error_m < 1e-12);
    CHECK(row.ours.missed == 0);
    CHECK(row.fcl.has_value() == (row.situation != bench::Situation::apart));  // it would crash
  }
  const std::string text = line(bench::Format::csv, rows.back());
  CHECK(text.starts_with("pair:sphere-half_space,apart,"));
  CHECK(text.ends_with(",-,-,-,-,-\n"));
  // What FCL does to capsules is seen in its rows.
  for (const bench::PairRow& row : run(named("pair:capsule-capsule"))) {
    CHECK(row.ours.error_m < 1e-12);
    CHECK(row.ours.excess_m < 1e-9);
    REQUIRE(row.fcl);
    if (row.situation == bench::Situation::angle) CHECK(row.fcl->error_m > 0.01);
    if (row.situation == bench::Situation::apart) CHECK(row.fcl->error_m < 1e-6);
  }
}
