// FCL's meshes, which are surfaces in triangles each by itself, against ours, which are solids:
// what FCL 0.7 says of poses whose contact is known in closed form.
#include "server/collision/manifolds.h"
#include "tests/unit/collision_fcl_known.h"

using namespace cradle;
using bench::FclQuestion;

namespace {

constexpr int kMeshPoses = 200;
constexpr double kDeep = 0.1;  // m: more than eight triangles

const Solid kHullBox = hull_box();
const Solid kBoxMesh = mesh_solid(kHullBox.hull());  // 12 triangles
const Solid kBody = Shape::box({0.3, 0.3, 0.3}), kMeshesHull = hull_box({0.3, 0.3, 0.3});
const Solid kMeshesMesh = mesh_solid(kMeshesHull.hull());

/// A ball of radius 1 in 320 triangles.
Solid ball_hull() {
  const double g = std::numbers::phi;
  std::vector<Vector> points;
  for (const double a : {1.0, -1.0}) {
    for (const double b : {g, -g}) {
      for (const Vector& v : {Vector(0, a, b), Vector(a, b, 0), Vector(b, 0, a)}) {
        points.push_back(v.normalized());
      }
    }
  }
  for (int halved = 0; halved < 2; ++halved) {  // each triangle in four
    const Solid hull(make_hull(points).geometry);
    const ConvexHull& h = hull.hull();
    for (std::size_t f = 0; f < h.face_count(); ++f) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto i = static_cast<std::size_t>(h.face(f)[k]);
        const auto j = static_cast<std::size_t>(h.face(f)[(k + 1) % 3]);
        if (i < j) points.push_back((h.vertices[i] + h.vertices[j]).normalized());
      }
    }
  }
  return Solid(make_hull(points).geometry);
}
/// Made when first asked for: every process would wait for it, seconds under a sanitizer.
const Solid& hull_ball() {
  static const Solid made = ball_hull();
  return made;
}
const Solid& ball_mesh() {
  static const Solid made = mesh_solid(hull_ball().hull());
  return made;
}

/// All that a body has with a surface, as one depth and one normal: those of the deepest point.
struct DeepestPoint {
  double depth = -std::numeric_limits<double>::infinity();
  Vector n = Vector::Zero();  // from A to B
  int points = 0;
};

DeepestPoint deepest_point(const Pair& pair) {
  std::vector<Manifold> manifolds;
  add_manifolds({pair.A.shape, pair.X_WA, pair.A.geometry.get()},
                {pair.B.shape, pair.X_WB, pair.B.geometry.get()}, 0.02, manifolds);
  DeepestPoint found;
  for (const Manifold& m : manifolds) {
    if (deepest(m) > found.depth) found = {deepest(m), m.normal_W, m.count};
  }
  return found;
}

/// Ours must be right.
void check(const std::vector<Known>& known, int points) {
  for (const Known& k : known) {
    const DeepestPoint found = deepest_point(k.pair);
    REQUIRE(found.points >= points);
    REQUIRE(std::abs(found.depth - k.depth) < 1e-9);
    REQUIRE(angle_between(found.n, k.n) < 1e-6);
  }
}

Matrix turn_to(const Vector& from, const Vector& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to).toRotationMatrix();
}

/// `body` with its lowest point at `depth` below a random place well inside of a random face of the
/// mesh. It is turned by `R_FB` as seen from the face, with z along the normal.
Known on_a_face(const Solid& mesh, const ConvexHull& hull, const Solid& body, double depth,
                const Matrix& R_FB, Random& random) {
  const double face = random.uniform(0, static_cast<double>(hull.face_count()));
  const auto f = static_cast<std::size_t>(face);
  Vector place = Vector::Zero();
  double weights = 0;
  for (const std::int32_t v : hull.face(f)) {
    const double weight = random.uniform(0.5, 1);
    place += weight * hull.vertices[static_cast<std::size_t>(v)];
    weights += weight;
  }
  const Pose X{random.vector(3), random.rotation()};
  const Vector n = X.R * hull.normals[f];
  const Matrix R = turn_to(Vector::UnitZ(), n) * R_FB;
  const Vector lowest = R * support_point(body, R.transpose() * -n);
  const Vector at = X.x + X.R * (place / weights) - lowest - depth * n;
  return {{mesh, body, X, {at, R}}, depth, n};
}

std::vector<Known> balls_on(const Solid& mesh, const ConvexHull& hull) {
  Random random(91);
  std::vector<Known> known;
  for (int k = 0; k < kMeshPoses; ++k) {
    known.push_back(on_a_face(mesh, hull, Shape::sphere(0.4), 0.02, Matrix::Identity(), random));
  }
  return known;
}

/// On the box's mesh.
std::vector<Known> flush_boxes(const Solid& body) {
  Random random(93);
  std::vector<Known> known;
  for (int k = 0; k < kMeshPoses; ++k) {
    const Matrix turn = Eigen::AngleAxisd(random.uniform(0, 6), Vector::UnitZ()).matrix();
    known.push_back(on_a_face(kBoxMesh, kHullBox.hull(), body, 1e-3, turn, random));
  }
  return known;
}

}  // namespace

TEST_CASE("FCL gives a ball on a mesh up to three times, or less than nothing, of its depth") {
  // Each triangle by itself: the foot on a triangle beside the ball counts as if it were below it.
  const std::vector<Known> on_ball = balls_on(ball_mesh(), hull_ball().hull());
  const std::vector<Known> on_box = balls_on(kBoxMesh, kHullBox.hull());
  check(on_ball, 1);
  check(on_box, 1);
  const Theirs ball = ask_fcl_known(on_ball, FclQuestion::contacts);
  const Theirs box = ask_fcl_known(on_box, FclQuestion::contacts);
  CAPTURE(ball, box);
  CHECK(ball.turned > kMeshPoses * 9 / 10);
  CHECK(box.turned > kMeshPoses / 2);
  CHECK(ball.off_share > 1);
  CHECK(box.off_share > 1);
}

TEST_CASE("FCL turns the normal of a box that stands on its corner on a mesh") {
  Random random(92);
  const Matrix on_corner = turn_to(Vector(1, 1, 1), -Vector::UnitZ());
  for (const Solid& body : {kBody, kMeshesHull}) {
    std::vector<Known> known;
    for (int k = 0; k < kMeshPoses; ++k) {
      known.push_back(on_a_face(kBoxMesh, kHullBox.hull(), body, 0.02, on_corner, random));
    }
    check(known, 1);
    const Theirs theirs = ask_fcl_known(known, FclQuestion::contacts);
    CAPTURE(theirs);
    CHECK(theirs.turned > kMeshPoses / 50);
    CHECK(theirs.off_angle > 0.3);
    CHECK(theirs.off_m > 1e-3);
  }
}

TEST_CASE("FCL gives two meshes that lie flush 560 times their depth, along other axes") {
  // With us one of the two is a hull: meshes do not move, and two of them do not meet. FCL's
  // points are corners of triangles.
  const std::vector<Known> known = flush_boxes(kMeshesHull);
  check(known, 4);
  std::vector<Known> as_meshes = known;
  for (Known& k : as_meshes) k.pair.B = kMeshesMesh;
  const Theirs theirs = ask_fcl_known(as_meshes, FclQuestion::contacts);
  CAPTURE(theirs);
  CHECK(theirs.turned > kMeshPoses / 2);
  CHECK(theirs.off_share > 100);
}

TEST_CASE("FCL turns some normals of boxes that lie flush on a mesh by more than 30 degrees") {
  for (const Solid& body : {kBody, kMeshesHull}) {
    const std::vector<Known> known = flush_boxes(body);
    check(known, 4);
    const Theirs theirs = ask_fcl_known(known, FclQuestion::contacts);
    CAPTURE(theirs);
    CHECK(theirs.off_angle > 0.5);
    CHECK(theirs.off_share > 0.1);
  }
}

TEST_CASE("FCL gives a mesh deep in a half-space any of its triangles, not the deepest") {
  Random random(94);
  std::vector<Known> known;
  for (int k = 0; k < kMeshPoses; ++k) {
    Pair pair{ball_mesh(),
              Shape::half_space(),
              {random.vector(3), random.rotation()},
              {random.vector(3), random.rotation()}};
    const Vector n = -pair.X_WB.R.col(2);
    pair.X_WB.x =
        pair.X_WA.x + n * (support(hull_ball(), {Vector::Zero(), pair.X_WA.R}, n) - kDeep);
    known.push_back({pair, kDeep, n});
  }
  check(known, 1);
  const Theirs theirs = ask_fcl_known(known, FclQuestion::contacts);
  CAPTURE(theirs);
  CHECK(theirs.turned == 0);
  CHECK(theirs.off_share > 0.1);
}

TEST_CASE("FCL finds nothing of a body that is inside of a mesh, and says it is apart") {
  Random random(95);
  const Solid small_hull = hull_box({0.05, 0.05, 0.05});
  for (const Solid& body :
       {Solid(Shape::sphere(0.1)), Solid(Shape::box({0.05, 0.05, 0.05})), small_hull}) {
    std::vector<Known> known;
    for (int k = 0; k < kMeshPoses; ++k) {
      const Vector at = random.vector(0.35);
      int axis = 0;
      const double most = at.cwiseAbs().maxCoeff(&axis);
      Known inside{{kBoxMesh, body, {random.vector(3), random.rotation()}, {}}, 0, {}};
      const Pose& X = inside.pair.X_WA;
      inside.pair.X_WB = {X.x + X.R * at, X.R};
      inside.n = X.R.col(axis) * std::copysign(1, at[axis]);
      inside.depth = 0.5 - most + support(body, {}, Vector::Unit(axis));
      known.push_back(inside);
    }
    check(known, 1);
    CHECK(ask_fcl_known(known, FclQuestion::contacts).missed == kMeshPoses);
    CHECK(ask_fcl_known(known, FclQuestion::signed_distance).least_m < -0.2);
  }
}

TEST_CASE("FCL exchanges a shape and a mesh") {
  std::vector<Known> known = balls_on(ball_mesh(), hull_ball().hull());
  for (Known& k : known) {
    k.pair = k.pair.swapped();
    k.n = -k.n;
  }
  check(known, 1);
  const Theirs theirs = ask_fcl_known(known, FclQuestion::contacts);
  CHECK(theirs.exchanged == kMeshPoses);
}

TEST_CASE("FCL's distance of a ball in a mesh is no depth") {
  // 0 but for noise, or -1 of a box, with and without its signed distance.
  const std::vector<Known> balls = balls_on(ball_mesh(), hull_ball().hull());
  const std::vector<Known> boxes = flush_boxes(kBody);
  for (const FclQuestion question : {FclQuestion::distance, FclQuestion::signed_distance}) {
    const Theirs ball = ask_fcl_known(balls, question), box = ask_fcl_known(boxes, question);
    CAPTURE(ball, box);
    CHECK(ball.off_share == Approx(1));
    CHECK(box.off_m == Approx(0.999));
  }
}
