// What ends a program that asks FCL 0.7, or throws: asked in a child process, which may die of it.
// Ours are right at the same poses, whose contact is known in closed form.
#include "tests/unit/collision_fcl_known.h"

using namespace cradle;
using bench::FclQuestion;
using bench::FclWay;

namespace {

constexpr FclWay kOtherSolver{.by_other_solver = true};

const Solid kCrashBox = Shape::box({0.5, 0.5, 0.5}), kCrashHull = hull_box();

Solid random_box(Random& random) {
  return Shape::box({random.uniform(0.2, 1), random.uniform(0.2, 1), random.uniform(0.2, 1)});
}

/// Box on box, face on face, B turned at random about the common normal.
Known kissing(const Solid& A, const Solid& B, double depth, const Matrix& R_WA, Random& random) {
  const Pose X{random.vector(5), R_WA};
  const Vector up = Vector::UnitZ();
  const double height = support(A, {}, up) + support(B, {}, up);
  const Matrix turn = Eigen::AngleAxisd(random.uniform(0, 6), up).matrix();
  const Vector above(random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), height - depth);
  return {{A, B, X, {X.x + X.R * above, X.R * turn}}, depth, X.R.col(2)};
}

}  // namespace

TEST_CASE("FCL's signed distance of boxes that just touch throws, or ends the program") {
  Random random(73);
  constexpr int kPoses = 1000;
  const auto ask = [&](double depth) {
    std::vector<Known> known;
    for (int k = 0; k < kPoses; ++k) {
      const Solid A = random_box(random), B = random_box(random);
      known.push_back(kissing(A, B, depth, Matrix::Identity(), random));
    }
    for (const Known& k : known) check_known(k, 1, 1e-13, 1e-12);
    return ask_fcl_known(known, FclQuestion::signed_distance);
  };
  const Theirs touching = ask(0);
  CAPTURE(touching);
  CHECK(touching.aborted > kPoses / 50);
  CHECK(touching.threw > 0);
  CHECK(touching.without_normal > kPoses / 20);
  // Of faces in each other by 1e-9 to 1e-14 m one in a hundred was seen to throw, too, in poses
  // that are not known any more. Here none does; the last normals are noise.
  for (const double depth : {1e-3, 1e-6, 1e-9, 1e-12, 1e-14}) {
    const Theirs theirs = ask(depth);
    CAPTURE(depth, theirs);
    CHECK(theirs.threw + theirs.died() == 0);
    if (depth == 1e-14) CHECK(theirs.turned > kPoses / 2);
  }
}

TEST_CASE("FCL's distance of anything to a half-space ends the program") {
  Random random(74);
  for (const auto& [kind_A, kind_B] : colliding_kinds()) {
    if (kind_B != ShapeKind::half_space) continue;
    CAPTURE(word_of(kind_A));
    std::vector<Known> known;
    for (int trial = 0; trial < 10; ++trial) {
      Pair pair = random.pair(kind_A, kind_B);
      const Vector n = -pair.X_WB.R.col(2);
      const double gap = random.uniform(0, 0.019);
      pair.X_WB.x += n * (overlap(pair, n) + gap);
      known.push_back({pair, -gap, n});
      known.push_back({pair.swapped(), -gap, -n});
    }
    for (const Known& k : known) check_known(k, 1, 1e-12, 1e-12);
    const Theirs theirs = ask_fcl_known(known, FclQuestion::distance);
    CAPTURE(theirs);
    // Of ellipsoids, whichever comes second is answered by the least number there is.
    const bool is_ellipsoid = kind_A == ShapeKind::ellipsoid;
    CHECK(theirs.segfaulted == (is_ellipsoid ? theirs.asked / 2 : theirs.asked));
    if (is_ellipsoid) CHECK(theirs.off_m > 1e300);
  }
}

TEST_CASE("FCL's other solver ends the program when asked for a signed distance") {
  // Of pairs for which it has no closed form.
  Random random(96);
  std::vector<Known> capsules, boxes;
  const Solid mesh = mesh_solid(kCrashHull.hull());
  for (int k = 0; k < 20; ++k) {
    const Solid capsule = Shape::capsule(0.3, 0.5);
    const Pose A{random.vector(3), random.rotation()};
    const Matrix R = random.rotation();
    const Vector n = A.R.col(2).cross(R.col(2)).normalized();  // side on side, middle on middle
    capsules.push_back({{capsule, capsule, A, {A.x + 0.59 * n, R}}, 0.01, n});
    boxes.push_back(kissing(kCrashHull, kCrashBox, 1e-3, random.rotation(), random));
  }
  for (const Known& k : capsules) check_known(k, 1, 1e-12, 1e-9);
  for (const Known& k : boxes) check_known(k, 3, 1e-12, 1e-12);
  for (Known& k : boxes) k.pair.A = mesh;
  CHECK(ask_fcl_known(capsules, FclQuestion::signed_distance, kOtherSolver).aborted == 20);
  CHECK(ask_fcl_known(boxes, FclQuestion::signed_distance, kOtherSolver).aborted == 20);
  CHECK(ask_fcl_known(capsules, FclQuestion::signed_distance).died() == 0);
}
