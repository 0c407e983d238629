// FCL's continuousCollide against our time of impact: bodies that fall on a wall of 5 cm, which
// they certainly hit. FCL is asked in a child process.
#include "server/collision/time_of_impact.h"
#include "tests/bench/fcl_oracle.h"
#include "tests/unit/collision_pairs.h"

using namespace cradle;
using bench::ask_fcl_impacts;
using bench::FclAnswer;
using bench::FclImpact;
using bench::FclSearch;

namespace {

const Vector kTravel(0, 0, -4);  // m

Solid hull_of(const Vector& half) {
  std::vector<Vector> corners;
  for (int k = 0; k < 8; ++k) {
    corners.push_back(half.cwiseProduct(Vector(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)));
  }
  return Solid(make_hull(corners).geometry);
}

/// Bodies above the middle of a wall, and so far down its top that they reach it within the time.
std::vector<Pair> falls(const Solid& wall, const Solid& body, int count) {
  Random random(61);
  std::vector<Pair> pairs;
  for (int k = 0; k < count; ++k) {
    const Vector above{random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), random.uniform(1, 3)};
    const Matrix turn = Eigen::AngleAxisd(random.uniform(0, 6), Vector::UnitZ()).matrix();
    pairs.push_back({wall, body, {Vector::Zero(), turn}, {above, random.rotation()}});
  }
  return pairs;
}

/// When B reaches the top of the wall, z = 0.025, exactly.
double exact_time(const Pair& pair) {
  const double bottom = -support(pair.B, pair.X_WB, -Vector::UnitZ());
  return (bottom - 0.025) / -kTravel.z();
}

/// How many of them FCL gets wrong; ours must be right in all.
struct Found {
  int missed = 0, wrong = 0, died = 0;
};

Found compare(const Solid& wall, const Solid& body, int count, FclSearch search,
              bool as_mesh = false) {
  const std::vector<Pair> pairs = falls(wall, body, count);
  const std::vector<FclImpact> theirs = ask_fcl_impacts(pairs, kTravel, search, as_mesh);
  Found found;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    CAPTURE(k);
    const Pair& pair = pairs[k];
    const double exact = exact_time(pair);
    const Collider a{pair.A.shape, pair.X_WA, pair.A.geometry.get()};
    const Collider b{pair.B.shape, pair.X_WB, pair.B.geometry.get()};
    Path still, fall;
    still.x = pair.X_WA.x;
    fall.x = pair.X_WB.x;
    fall.travel = kTravel;
    const TimeOfImpact ours = time_of_impact({a, still}, {b, fall});
    const ImpactLengths lengths = impact_lengths(thickness(a), thickness(b));
    REQUIRE(ours.kind == TimeOfImpact::Kind::hit);
    REQUIRE((exact - ours.time) * kTravel.norm() > -1e-9);
    REQUIRE((exact - ours.time) * kTravel.norm() < lengths.gap + lengths.tolerance + 1e-9);
    REQUIRE(ours.normal_W.dot(Vector::UnitZ()) == Approx(1).margin(1e-6));
    if (theirs[k].end != FclAnswer::End::answered) {
      ++found.died;
    } else if (!theirs[k].is_hit) {
      ++found.missed;
    } else {
      found.wrong += std::abs(theirs[k].time - exact) > 0.01;
    }
  }
  return found;
}

const Solid kWall = Shape::box({1, 1, 0.025});

}  // namespace

TEST_CASE("FCL's default search for impacts lets most bodies through a thin wall") {
  for (const Solid& body : {Solid(Shape::sphere(0.05)), Solid(Shape::box({0.05, 0.05, 0.05}))}) {
    CAPTURE(word_of(body.shape.kind));
    const Found found = compare(kWall, body, 200, FclSearch::samples);
    CAPTURE(found.missed, found.wrong, found.died);
    CHECK(found.missed > 100);
  }
}

TEST_CASE(
    "FCL's conservative advancement is right about spheres, and misses boxes at a thin wall") {
  const Found sphere = compare(kWall, Shape::sphere(0.1), 1000, FclSearch::advancement);
  CHECK(sphere.missed + sphere.wrong + sphere.died == 0);
  const Found box = compare(kWall, Shape::box({0.1, 0.1, 0.1}), 1000, FclSearch::advancement);
  CHECK(box.missed > 0);
}

TEST_CASE("FCL's conservative advancement of a sphere to a mesh ends the program") {
  const Found found =
      compare(hull_of({1, 1, 0.025}), Shape::sphere(0.1), 20, FclSearch::advancement, true);
  CHECK(found.died == 20);
}
