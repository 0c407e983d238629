// Edges against edges: where sharp and round lines touch that are nearly parallel, and where two
// edges cross. Each was a fault of ours once.
#include "server/collision/convex_pair.h"
#include "tests/unit/collision_pairs.h"

using namespace cradle;

namespace {

constexpr double kQuarter = 0.78539816339744831;  // of half a turn

/// A rod along x that stands on its edge: with z up, the edge is its highest and lowest part.
const Matrix kOnEdge = Eigen::AngleAxisd(kQuarter, Vector::UnitX()).matrix();

Matrix about(const Vector& axis, double angle) { return Eigen::AngleAxisd(angle, axis).matrix(); }

}  // namespace

TEST_CASE("two sharp edges that are nearly parallel touch only where they cross") {
  // A plate and a flat hull, 56 mm deep. The ends of the hull's edge are 60 mm beside the plate's:
  // they were taken to fall away by 45 degrees, and stood 8 and 39 mm outside of both.
  const std::vector<Vector> corners = {
      {1.4944091203005476, 0.052934356607753683, -0.041364996762953916},
      {-0.57023796607511101, 0.030609747851922244, 0.34974468616434384},
      {0.0067297324907258449, -0.1040502678557462, 0.025080137406179825},
      {-1.1969846873290879, 0.072065945998943101, 0.089888874523691584},
      {0.74431937361303713, 0.056690782367637554, -0.28150306931280633},
      {-1.2394842616931034, 0.01677268156888416, -0.26720532005246139},
      {-0.11123409022758915, -0.098652504885182804, 0.12355192191781893},
      {-0.90397019305463377, 0.0110591316296099, -0.33057037919586713}};
  Pair pair{Shape::box({1.7230375051628068, 0.20133710733344398, 0.084497765388728108}),
            Solid(make_hull(corners).geometry),
            {{-1.6890942044979931, -0.69782050776684423, 0.36892120673761974}, {}},
            {{-1.9713388245947359, -0.95949703288745569, 0.33196244963648802}, {}}};
  pair.X_WA.R << 0.40475092595613194, -0.42844046399194841, 0.80784618384443563,
      -0.82994221274540703, -0.5430035094194714, 0.12784018249906987, 0.38389140579193926,
      -0.72220908161868325, -0.57536199995010673;
  pair.X_WB.R << -0.24856015160327205, 0.16110523180170228, 0.95512457581253674,
      0.88365175980494004, 0.44157231724678825, 0.15547815291845418, -0.39670822833486941,
      0.88264318551010268, -0.25211820371402682;
  const Manifold manifold = pair.collide(kMargin);
  REQUIRE(deepest(manifold) == Approx(0.0561591906).margin(1e-9));
  check_sound(pair, manifold, kMargin, 1e-9);
  check_sound(pair.swapped(), pair.swapped().collide(kMargin), kMargin, 1e-9);
}

TEST_CASE("two edges that cross touch there, however long they are and however deep") {
  Random random(91);
  int away = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    CAPTURE(trial);
    const double turn = random.uniform(0.3, 1.2);
    const double x = random.uniform(-0.9, 0.9), y = random.uniform(-0.9, 0.9);
    const double depth = random.uniform(1e-4, 0.02);
    // B on A: its lower edge meets A's upper one where it is `x` along A, and `y` along B.
    const Matrix R_AB = about(Vector::UnitZ(), turn);
    const Vector above(x, 0, 2 * 0.05 * std::sqrt(2.0) - depth);
    const Pose all{random.vector(2), random.rotation()};
    const Vector p_BoAo = R_AB * Vector(-y, 0, 0);
    const Pair pair{hull_of_box({1, 0.05, 0.05}),
                    Shape::box({1, 0.05, 0.05}),
                    {all.x, all.R * kOnEdge},
                    {all.x + all.R * (above + p_BoAo), all.R * R_AB * kOnEdge}};
    const Manifold manifold = pair.collide(kMargin);
    check_sound(pair, manifold, kMargin, 1e-9);
    REQUIRE(deepest(manifold) == Approx(depth).margin(1e-9));
    const Vector crossing = all.x + all.R * Vector(x, 0, 0.05 * std::sqrt(2.0) - depth / 2);
    const auto near = [&](const ContactPoint& p) { return (p.p_W - crossing).norm() < 1e-6; };
    away += !std::ranges::any_of(points(manifold), near);
  }
  CHECK(away == 0);
}

TEST_CASE("the point that touches last is of both shapes") {
  // Two edges make a parallelogram of the set of all a - b, which the search for the least overlap
  // has as two triangles. It took the point from one of them, though it was on the other, and so
  // put a contact 0.2 m beside both.
  Random random(93);
  int overlapping = 0;
  for (const auto& [kind_A, kind_B] : colliding_kinds()) {
    for (int trial = 0; trial < 4000; ++trial) {
      const Pair pair = random.pair(kind_A, kind_B);
      if (!is_polytope(pair.A) || !is_polytope(pair.B)) break;
      CAPTURE(trial, word_of(kind_A), word_of(kind_B));
      const ConvexPair seen({pair.A.shape, pair.X_WA, pair.A.geometry.get()},
                            {pair.B.shape, pair.X_WB, pair.B.geometry.get()});
      SupportHints hints;
      const LeastOverlap least = least_overlap(seen, kMargin, hints);
      if (!least.is_within_limit) continue;
      const Pose in_A{seen.t, seen.R};
      REQUIRE(outside(pair.A, {}, least.p_A) < 1e-9);
      REQUIRE(outside(pair.B, in_A, least.p_A - least.overlap * least.n) < 1e-9);
      overlapping += least.overlap > 0;
    }
  }
  CHECK(overlapping > 1000);
}

TEST_CASE("the sides of cones fall away as the cone is wide there") {
  // The whole side was as round as half of the base: points at the tip stood up to 80 mm outside.
  Random random(92);
  const std::vector<Solid> others = {Shape::cone(0.2, 1), Shape::capsule(0.1, 0.8),
                                     Shape::cylinder(0.2, 0.8), Shape::box({0.1, 0.1, 1})};
  int ends = 0;
  for (const Solid& other : others) {
    for (int trial = 0; trial < 2000; ++trial) {
      CAPTURE(trial, word_of(other.shape.kind));
      // Side by side, nearly: along z, with a turn that the contact is seen to have.
      const Matrix lean = about(Vector::UnitY(), random.uniform(-0.3, 0.3));
      const Matrix turn = about(Vector::UnitX(), random.uniform(-0.1, 0.1));
      const Matrix spin = about(Vector::UnitZ(), random.uniform(0, 6));
      Pair pair{Shape::cone(0.3, 1), other, {}, {{3, 0, random.uniform(-0.5, 0.5)}, {}}};
      pair.X_WB.R = lean * turn * spin;
      for (int k = 0; k < 3; ++k) {
        const Vector n = pair.collide(10).normal_W;
        pair.X_WB.x += n * (overlap(pair, n) - random.uniform(-0.01, 0.05));
      }
      const Manifold manifold = pair.collide(kMargin);
      check_sound(pair, manifold, kMargin, 1e-9);
      ends += manifold.count > 1;
    }
  }
  CHECK(ends > 200);
}

TEST_CASE("discs that are level but for rounding, and only just over another face, touch in both") {
  // No corner of the face was over the other's, and the point of the rim that seemed deepest stood
  // up to 10 m outside.
  Random random(94);
  int few = 0;
  for (const bool is_cylinder : {false, true}) {
    for (int trial = 0; trial < 3000; ++trial) {
      CAPTURE(is_cylinder, trial);
      const double r = random.uniform(0.1, 1.5), a = random.uniform(0.02, 1);
      const Solid other = is_cylinder ? Solid(Shape::cylinder(a, 0.2)) : hull_of_box({a, a, 0.2});
      const Pose all{random.vector(1), random.rotation()};
      const double tilt = std::pow(10, random.uniform(-10, -6));
      const Matrix lean = about(random.direction(), tilt);
      // Beside each other but for a lens of that width; a quarter turn: the hull's corner first.
      const double reach = is_cylinder ? a : a * std::sqrt(2.0);
      const double width = std::pow(10, random.uniform(-4, -1)) * std::min(r, a);
      const double depth = random.uniform(0, 1e-3);
      const Vector x(r + reach - width, 0, 0.5 - depth);
      const Pair pair{Shape::cylinder(r, 0.3),
                      other,
                      all,
                      {all.x + all.R * x, all.R * lean * about(Vector::UnitZ(), kQuarter)}};
      const Manifold manifold = pair.collide(kMargin);
      REQUIRE(manifold.count > 0);
      for (const ContactPoint& point : points(manifold)) {
        const double slack = std::abs(point.separation) / 2 + kTolerances.clip_slack_m;
        REQUIRE(outside(pair.A, pair.X_WA, point.p_W) <= slack);
        REQUIRE(outside(pair.B, pair.X_WB, point.p_W) <= slack);
      }
      few += manifold.count == 1;
    }
  }
  CHECK(few > 100);
}

TEST_CASE("lines along each other touch at their ends once") {
  // Where they crossed at an end, a second point stood there, and changed ends as they turned.
  Random random(95);
  const Matrix lying = about(Vector::UnitY(), 2 * kQuarter);  // z along x
  const std::vector<Solid> rods = {Shape::capsule(0.1, 0.5), Shape::cylinder(0.1, 0.5),
                                   Shape::cylinder(0.2, 0.3)};
  for (const Solid& lower : rods) {
    for (const Solid& upper : rods) {
      for (int trial = 0; trial < 1000; ++trial) {
        CAPTURE(word_of(lower.shape.kind), word_of(upper.shape.kind), trial);
        const double yaw = std::pow(10, random.uniform(-8, -2));
        const double lean = yaw * random.uniform(-1, 1);
        Pair pair{lower, upper, {{0, 0, 0}, lying}, {}};
        pair.X_WB.R = about(Vector::UnitZ(), yaw) * about(Vector::UnitY(), lean) * lying;
        pair.X_WB.x = {random.uniform(-0.2, 0.2), yaw * random.uniform(-0.5, 0.5), 1};
        pair.X_WB.x.z() += overlap(pair, Vector::UnitZ()) - random.uniform(0, 1e-3);
        const Manifold manifold = pair.collide(kMargin);
        check_sound(pair, manifold, kMargin, 1e-9);
        for (const ContactPoint& one : points(manifold)) {
          for (const ContactPoint& other : points(manifold)) {
            REQUIRE((&one == &other || (one.p_W - other.p_W).norm() > 1e-4));
          }
        }
      }
    }
  }
}
