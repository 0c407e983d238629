// FCL's continuousCollide against our time of impact: bodies that fall on a wall of 5 cm, which
// they certainly hit. FCL is asked in a child process.
#include "server/collision/extents.h"
#include "server/collision/time_of_impact.h"
#include "tests/unit/collision_fcl_known.h"

using namespace cradle;
using bench::ask_fcl_impacts;
using bench::FclEnd;
using bench::FclImpact;
using bench::FclMotion;
using bench::FclSearch;

namespace {

const Vector kTravel(0, 0, -4);  // m

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

/// FCL may be asked about another body, of the same form.
Found compare_impacts(const Solid& wall, const Solid& body, int count, FclSearch search,
                      FclMotion motion = FclMotion::translation,
                      const Solid* body_for_fcl = nullptr) {
  const std::vector<Pair> pairs = falls(wall, body, count);
  std::vector<Pair> pairs_for_fcl = pairs;
  for (Pair& pair : pairs_for_fcl) {
    if (body_for_fcl != nullptr) pair.B = *body_for_fcl;
  }
  const std::vector<FclImpact> theirs = ask_fcl_impacts(pairs_for_fcl, kTravel, search, motion);
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
    if (theirs[k].end != FclEnd::End::answered) {
      found.died += theirs[k].end == FclEnd::End::died;
    } else if (!theirs[k].is_hit) {
      ++found.missed;
    } else {
      found.wrong += std::abs(theirs[k].time - exact) > 0.01;
    }
  }
  return found;
}

const Solid kWall = Shape::box({1, 1, 0.025});
const Solid kHullBody = hull_box({0.1, 0.1, 0.1}), kMeshBody = mesh_solid(kHullBody.hull());
const Solid kHullWall = hull_box({1, 1, 0.025}), kMeshWall = mesh_solid(kHullWall.hull());

}  // namespace

TEST_CASE("FCL's default search for impacts lets most bodies through a thin wall") {
  for (const Solid& body : {Solid(Shape::sphere(0.05)), Solid(Shape::box({0.05, 0.05, 0.05}))}) {
    CAPTURE(word_of(body.shape.kind));
    const Found found = compare_impacts(kWall, body, 200, FclSearch::samples);
    CAPTURE(found.missed, found.wrong, found.died);
    CHECK(found.missed > 100);
  }
}

TEST_CASE(
    "FCL's conservative advancement is right about spheres, and misses boxes at a thin wall") {
  const Found sphere = compare_impacts(kWall, Shape::sphere(0.1), 1000, FclSearch::advancement);
  CHECK(sphere.missed + sphere.wrong + sphere.died == 0);
  const Found box =
      compare_impacts(kWall, Shape::box({0.1, 0.1, 0.1}), 1000, FclSearch::advancement);
  CHECK(box.missed > 0);
}

TEST_CASE("FCL's conservative advancement of a sphere to a mesh ends the program") {
  const Found found = compare_impacts(kMeshWall, Shape::sphere(0.1), 20, FclSearch::advancement);
  CHECK(found.died == 20);
}

TEST_CASE("FCL's searches for impacts miss hulls at a thin wall, and nearly all meshes") {
  // With us one of two meshes is a hull: meshes do not move.
  constexpr int kCount = 100;
  const auto advancement = [&](const Solid& wall, const Solid& body) {
    return compare_impacts(wall, kHullBody, kCount, FclSearch::advancement, FclMotion::translation,
                           &body);
  };
  // The faults of hulls come and go with the poses: 39 in 100 were seen, here it is one or two.
  CHECK(advancement(kHullWall, kHullBody).missed > 0);
  CHECK(advancement(kMeshWall, kMeshBody).missed > kCount * 3 / 4);
}

TEST_CASE("FCL's screw motion is another one, even of a body that does not turn") {
  constexpr int kCount = 100;
  const Solid ball = Shape::sphere(0.1);
  const auto wrong = [&](const Solid& wall, const Solid& body, FclSearch search) {
    const Found found = compare_impacts(wall, body, kCount, search, FclMotion::screw);
    return found.missed + found.wrong;
  };
  for (const FclSearch search : {FclSearch::samples, FclSearch::advancement}) {
    CHECK(wrong(kWall, ball, search) > kCount * 9 / 10);
    CHECK(wrong(kHullWall, kHullBody, search) > kCount * 9 / 10);
  }
  CHECK(compare_impacts(kMeshWall, ball, 20, FclSearch::advancement, FclMotion::screw).died == 20);
}
