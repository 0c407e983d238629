// The contacts of compounds are those of their parts, found without looking at all of them.
#include "server/collision/manifolds.h"
#include "tests/unit/collision_pairs.h"
#include "tests/unit/trials.h"

using namespace cradle;

namespace {

CompoundPart part_of(const Solid& solid, const Vector& p, const Rotation& q) {
  const Shape shape = solid.geometry ? Shape{ShapeKind::hull, {}} : solid.shape;
  return {shape, solid.geometry, p, q, 1000};
}

/// A solid as the only part of a compound, at the same place.
struct Wrapped {
  Shape shape = Shape::stored(ShapeKind::compound, 1);
  GeometryPointer geometry;
  Pose X_WB;

  Wrapped(const Solid& solid, const Pose& X_WP, Random& random) {
    const Rotation q_BP(random.rotation());
    const Vector p = random.vector(1);
    geometry = make_compound({part_of(solid, p, q_BP)}).geometry;
    X_WB.R = X_WP.R * q_BP.toRotationMatrix().transpose();
    X_WB.x = X_WP.x - X_WB.R * p;
  }
  Collider collider() const { return {shape, X_WB, geometry.get()}; }
};

bool is_same_manifold(const Manifold& a, const Manifold& b, double tolerance) {
  if (a.count != b.count || (a.normal_W - b.normal_W).norm() > tolerance) return false;
  return std::ranges::all_of(points(a), [&](const ContactPoint& p) {
    return std::ranges::any_of(points(b), [&](const ContactPoint& q) {
      return (p.p_W - q.p_W).norm() < tolerance &&
             std::abs(p.separation - q.separation) < tolerance;
    });
  });
}

std::vector<Manifold> manifolds_of(const Collider& A, const Collider& B,
                                   std::int64_t* work = nullptr) {
  std::vector<Manifold> found;
  const std::int64_t done = add_manifolds(A, B, kMargin, found);
  if (work != nullptr) *work = done;
  return found;
}

/// Boxes of 0.1 m on a grid with gaps, and every other one a ball.
GeometryPointer grid(int nx, int ny, int nz) {
  std::vector<CompoundPart> parts;
  for (int i = 0; i < nx * ny * nz; ++i) {
    const Vector p(0.25 * (i % nx), 0.25 * (i / nx % ny), 0.25 * (i / nx / ny));
    const Shape shape = i % 2 == 0 ? Shape::box({0.1, 0.1, 0.1}) : Shape::sphere(0.1);
    parts.push_back({shape, nullptr, p, Rotation::Identity(), 1000});
  }
  return make_compound(std::move(parts)).geometry;
}

const Shape kCompound = Shape::stored(ShapeKind::compound, 1);

}  // namespace

TEST_CASE("a compound of one part touches every kind as its part does") {
  Random random;
  for (const auto& [kind_A, kind_B] : colliding_kinds()) {
    if (kind_A == ShapeKind::half_space) continue;
    CAPTURE(word_of(kind_A), word_of(kind_B));
    int contacts = 0;
    for (int trial = 0; trial < 20'000 && contacts < trials(300); ++trial) {
      CAPTURE(trial);
      const Pair pair = random.pair(kind_A, kind_B);
      const Wrapped wrapped(pair.A, pair.X_WA, random);
      const Collider B{pair.B.shape, pair.X_WB, pair.B.geometry.get()};
      const Pose X_WP{
          wrapped.X_WB.x + wrapped.X_WB.R * std::get<Compound>(wrapped.geometry->value).X_BP[0].x,
          wrapped.X_WB.R * std::get<Compound>(wrapped.geometry->value).X_BP[0].R};
      const Manifold alone = collide({pair.A.shape, X_WP, pair.A.geometry.get()}, B, kMargin);
      const Manifold alone_B = collide(B, {pair.A.shape, X_WP, pair.A.geometry.get()}, kMargin);
      const auto found = manifolds_of(wrapped.collider(), B);
      const auto found_B = manifolds_of(B, wrapped.collider());
      REQUIRE(found.size() == (alone.count > 0 ? 1 : 0));
      REQUIRE(found_B.size() == (alone_B.count > 0 ? 1 : 0));
      if (alone.count == 0) continue;
      ++contacts;
      REQUIRE(is_same_manifold(found[0], alone, 1e-12));
      REQUIRE(is_same_manifold(found_B[0], alone_B, 1e-12));
      REQUIRE(found[0].part == 0);
    }
    CHECK(contacts == trials(300));
  }
}

TEST_CASE("a compound's contacts are those of all its parts, in their order") {
  Random random;
  int contacts = 0;
  for (int trial = 0; trial < trials(400); ++trial) {
    CAPTURE(trial);
    // Up to 60 random parts each, somewhere in a cube of 2 m.
    GeometryPointer geometries[2];
    for (GeometryPointer& geometry : geometries) {
      std::vector<CompoundPart> parts;
      const int count = 1 + static_cast<int>(random.uniform(0, 60));
      for (int i = 0; i < count; ++i) {
        constexpr ShapeKind kinds[] = {ShapeKind::sphere, ShapeKind::box, ShapeKind::capsule,
                                       ShapeKind::cylinder, ShapeKind::hull};
        const Solid solid = random.solid(kinds[i % 5]);
        const Vector at = random.vector(2);
        parts.push_back(part_of(solid, at, Rotation(random.rotation())));
      }
      geometry = make_compound(std::move(parts)).geometry;
      REQUIRE(geometry);
    }
    const Pose X_WA{random.vector(1), random.rotation()}, X_WB{random.vector(1), random.rotation()};
    const auto& A = std::get<Compound>(geometries[0]->value);
    const auto& B = std::get<Compound>(geometries[1]->value);
    std::vector<Manifold> expected;
    for (std::size_t i = 0; i < A.parts.size(); ++i) {
      const Pose X_A{X_WA.x + X_WA.R * A.X_BP[i].x, X_WA.R * A.X_BP[i].R};
      for (std::size_t j = 0; j < B.parts.size(); ++j) {
        const Pose X_B{X_WB.x + X_WB.R * B.X_BP[j].x, X_WB.R * B.X_BP[j].R};
        Manifold m = collide({A.parts[i].shape, X_A, A.parts[i].geometry.get()},
                             {B.parts[j].shape, X_B, B.parts[j].geometry.get()}, kMargin);
        m.part = i << 44 | j << 32;
        if (m.count > 0) expected.push_back(m);
      }
    }
    const auto found = manifolds_of({kCompound, X_WA, geometries[0].get()},
                                    {kCompound, X_WB, geometries[1].get()});
    REQUIRE(found.size() == expected.size());
    for (std::size_t k = 0; k < found.size(); ++k) {
      REQUIRE(found[k].part == expected[k].part);
      REQUIRE(is_same_manifold(found[k], expected[k], 0x1p-1000));  // the same bits
    }
    contacts += static_cast<int>(found.size());
    const auto swapped = manifolds_of({kCompound, X_WB, geometries[1].get()},
                                      {kCompound, X_WA, geometries[0].get()});
    REQUIRE(swapped.size() == expected.size());
  }
  CHECK(contacts > trials(10'000));
}

TEST_CASE("what a compound lies on, it touches with the parts that are near, of all it has") {
  for (const double tilt : {0.0, 0.3}) {
    const GeometryPointer small = grid(10, 10, 10), large = grid(64, 64, 1);
    const Pose X_WA{{0, 0, 0.1}, Eigen::AngleAxisd(tilt, Vector::UnitX()).toRotationMatrix()};
    const Pose ground;
    std::int64_t of_small = 0, of_large = 0;
    const Shape half_space = Shape::half_space();
    CHECK(manifolds_of({kCompound, X_WA, small.get()}, {half_space, ground}, &of_small).size() ==
          (tilt == 0 ? 100 : 10));
    CHECK(of_small < (tilt == 0 ? 200 : 50));
    CHECK(manifolds_of({kCompound, X_WA, large.get()}, {half_space, ground}, &of_large).size() ==
          (tilt == 0 ? 4096 : 64));
    const Shape ball = Shape::sphere(0.1);
    const Pose X_WB{X_WA.x + X_WA.R * Vector(5, 5, 0.2), Matrix::Identity()};
    CHECK(manifolds_of({ball, X_WB}, {kCompound, X_WA, large.get()}, &of_large).size() == 1);
    CHECK(of_large < 40);
  }
}

TEST_CASE("the work of two compounds grows with what touches, not with what they have") {
  // Two plates of n by n parts, their corners overlapping by two parts a side.
  const auto work = [](int n) {
    const GeometryPointer plate = grid(n, n, 1);
    const double offset = 0.25 * (n - 2);
    const Pose X_WA, X_WB{{offset, offset, 0.19}, Matrix::Identity()};
    std::int64_t done = 0;
    CHECK(manifolds_of({kCompound, X_WA, plate.get()}, {kCompound, X_WB, plate.get()}, &done)
              .size() == 4);
    return done;
  };
  const std::int64_t of_16 = work(4), of_1024 = work(32), of_4096 = work(64);
  CAPTURE(of_16, of_1024, of_4096);
  CHECK(of_1024 < 3 * of_16 + 30);
  CHECK(of_4096 < 3 * of_16 + 30);
}

TEST_CASE("compounds at poses that are not finite touch nothing") {
  const GeometryPointer plate = grid(4, 4, 1);
  const Shape half_space = Shape::half_space(), ball = Shape::sphere(1);
  for (const double bad : {std::nan(""), double(INFINITY)}) {
    const Pose X_WA{{bad, 0, 0}, Matrix::Identity()}, ground;
    CHECK(manifolds_of({kCompound, X_WA, plate.get()}, {half_space, ground}).empty());
    CHECK(manifolds_of({kCompound, X_WA, plate.get()}, {ball, ground}).empty());
    CHECK(manifolds_of({kCompound, X_WA, plate.get()}, {kCompound, ground, plate.get()}).empty());
  }
}
