// Any two convex shapes, against Bullet's GJK and EPA in double precision.
#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>
#include <btBulletCollisionCommon.h>

#include <memory>
#include <optional>

#include "tests/unit/collision_verdicts.h"

using namespace cradle;

namespace {

constexpr int kBulletPoses = 400;  // of each pair of kinds

btVector3 to_bullet(const Vector& v) { return {v.x(), v.y(), v.z()}; }
Vector from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

/// Null for half-spaces, which Bullet has in other functions, and for ellipsoids, which it has not.
std::unique_ptr<btConvexShape> shape_of(const Solid& solid) {
  const Shape& shape = solid.shape;
  const double r = shape.radius_m(), h = shape.half_length_m();
  std::unique_ptr<btConvexShape> made;
  switch (shape.kind) {
    case ShapeKind::sphere:
      return std::make_unique<btSphereShape>(r);
    case ShapeKind::capsule:
      return std::make_unique<btCapsuleShapeZ>(r, 2 * h);
    case ShapeKind::box:
      made = std::make_unique<btBoxShape>(to_bullet(to_eigen(shape.half_extents_m())));
      break;
    case ShapeKind::cylinder:
      made = std::make_unique<btCylinderShapeZ>(btVector3(r, r, h));
      break;
    case ShapeKind::cone:
      made = std::make_unique<btConeShapeZ>(r, 2 * h);
      break;
    case ShapeKind::hull: {
      auto hull = std::make_unique<btConvexHullShape>();
      for (const Vector& v : solid.hull().vertices) hull->addPoint(to_bullet(v));
      made = std::move(hull);
      break;
    }
    default:
      return nullptr;
  }
  made->setMargin(0);
  return made;
}

btTransform to_bullet(const Pose& X) {
  const Matrix& R = X.R;
  const btMatrix3x3 turn(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1),
                         R(2, 2));
  return btTransform(turn, to_bullet(X.x));
}

/// None where it does not tell.
std::optional<OtherAnswer> ask_bullet(const Pair& pair) {
  const auto A = shape_of(pair.A), B = shape_of(pair.B);
  if (!A || !B) return std::nullopt;
  btGjkEpaSolver2::sResults results;
  const btVector3 guess = to_bullet(pair.X_WB.x - pair.X_WA.x);
  if (!btGjkEpaSolver2::Penetration(A.get(), to_bullet(pair.X_WA), B.get(), to_bullet(pair.X_WB),
                                    guess, results)) {
    return std::nullopt;
  }
  // Theirs is from B to A, in the frame of A.
  return OtherAnswer{pair.X_WA.R * -from_bullet(results.normal), -results.distance};
}

}  // namespace

TEST_CASE("Bullet's EPA says what our manifolds say, but for local minima") {
  for (const auto& [kind_A, kind_B] : colliding_kinds()) {
    if (kind_A > kind_B) continue;
    Random random(61);
    if (!shape_of(random.solid(kind_A)) || !shape_of(random.solid(kind_B))) continue;
    CAPTURE(word_of(kind_A), word_of(kind_B));
    const bool is_exact = is_polytope(kind_A) && is_polytope(kind_B);
    Verdicts verdicts;
    int silent = 0, apart = 0;
    for (const Pair& pair : sunk_pairs(random, kind_A, kind_B, 0.01, kBulletPoses)) {
      const auto theirs = ask_bullet(pair);
      const Manifold ours = pair.collide(1e-3);
      if (!theirs && bench::parting(pair).overlap < 0) {  // nothing to tell: passed through
        ++apart;
        REQUIRE(deepest(ours) < 0);
        continue;
      }
      silent += !theirs;
      if (theirs && ours.count > 0)
        judge(verdicts, pair, ours, *theirs, is_exact ? 1e-9 : 1e-4, 1e-2);
    }
    CAPTURE(verdicts, silent, apart);
    CHECK(verdicts.asked + silent > kBulletPoses * 9 / 10);
    CHECK(silent <= kBulletPoses / 20);
    CHECK(verdicts.inconsistent <= kBulletPoses / 50);  // its EPA ran out of steps
    CHECK(verdicts.worse == 0);
    CHECK(verdicts.ours_worse_share() <= most_ours_worse(kind_A, kind_B));
  }
}
