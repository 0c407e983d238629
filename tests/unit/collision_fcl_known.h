/// Poses whose contact is known in closed form, and how far FCL's answers are from it.
#pragma once

#include <csignal>
#include <numbers>

#include "tests/bench/fcl_oracle.h"
#include "tests/unit/collision_verdicts.h"

namespace cradle {

/// A pair with its depth (m) and its normal from A to B.
struct Known {
  Pair pair;
  double depth = 0;
  Vector n = Vector::UnitZ();
};

inline double angle_between(const Vector& a, const Vector& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// FCL's answers to known poses, counted.
struct Theirs {
  int asked = 0, threw = 0, missed = 0;
  int aborted = 0, segfaulted = 0;  ///< and ended the program
  int without_normal = 0;           ///< shorter than a half
  int turned = 0;                   ///< a normal more than 1 degree off
  int exchanged = 0;                ///< named B as the first body
  int most_points = 0;              ///< in one pose
  double off_m = 0;                 ///< the depth, at most
  double off_share = 0;             ///< likewise, of the depth
  double off_angle = 0;             ///< rad, the normal, at most
  double least_m = 0;               ///< the least depth
  int died() const { return aborted + segfaulted; }
};

inline std::ostream& operator<<(std::ostream& out, const Theirs& t) {
  return out << "FCL: " << t.asked << " asked, " << t.threw << " threw, " << t.missed << " missed, "
             << t.aborted << " aborted, " << t.segfaulted << " segfaulted, " << t.without_normal
             << " without normal, " << t.turned << " turned, up to " << t.off_angle << " rad, "
             << t.exchanged << " exchanged, depth off by up to " << t.off_m << " m or "
             << t.off_share << " of it, from " << t.least_m << " m, at most " << t.most_points
             << " points";
}

inline Theirs ask_fcl_known(std::span<const Known> known, bench::FclQuestion question,
                            bench::FclWay way = {}) {
  std::vector<Pair> pairs;
  for (const Known& k : known) pairs.push_back(k.pair);
  const std::vector<bench::FclAnswer> answers = bench::ask_fcl(pairs, question, way);
  Theirs theirs;
  for (std::size_t k = 0; k < known.size(); ++k) {
    const bench::FclAnswer& answer = answers[k];
    ++theirs.asked;
    theirs.threw += answer.end == bench::FclEnd::End::threw;
    theirs.aborted += answer.signal == SIGABRT;
    theirs.segfaulted += answer.signal == SIGSEGV;
    if (answer.end != bench::FclEnd::End::answered) continue;
    if (answer.points == 0) {
      ++theirs.missed;
      continue;
    }
    const double depth = -answer.separation, off = std::abs(depth - known[k].depth);
    theirs.off_m = std::max(theirs.off_m, off);
    theirs.off_share = std::max(theirs.off_share, off / std::abs(known[k].depth));
    theirs.least_m = std::min(theirs.least_m, depth);
    theirs.most_points = std::max(theirs.most_points, answer.points);
    theirs.exchanged += answer.is_exchanged;
    if (answer.n.norm() < 0.5) {
      ++theirs.without_normal;
      continue;
    }
    const double angle = angle_between(answer.n, known[k].n);
    theirs.turned += angle > std::numbers::pi / 180;
    theirs.off_angle = std::max(theirs.off_angle, angle);
  }
  return theirs;
}

/// Ours must be right.
inline void check_known(const Known& known, int points, double off_m, double off_angle) {
  const Manifold manifold = known.pair.collide(0.02);
  REQUIRE(manifold.count >= points);
  REQUIRE(std::abs(deepest(manifold) - known.depth) < off_m);
  REQUIRE(angle_between(manifold.normal_W, known.n) < off_angle);
}

inline Solid hull_box(const Vector& half = Vector::Constant(0.5)) {
  std::vector<Vector> corners;
  for (int k = 0; k < 8; ++k) {
    corners.push_back(half.cwiseProduct(Vector(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)));
  }
  return Solid(make_hull(corners).geometry);
}

/// The hull's faces as a mesh, in triangles.
inline Solid mesh_solid(const ConvexHull& hull) {
  std::vector<Triangle> triangles;
  for (std::size_t f = 0; f < hull.face_count(); ++f) {
    const auto loop = hull.face(f);
    for (std::size_t k = 2; k < loop.size(); ++k) {
      triangles.push_back({loop[0], loop[k - 1], loop[k]});
    }
  }
  Solid solid(make_mesh(hull.vertices, triangles).geometry);
  solid.shape = Shape::stored(ShapeKind::mesh, 1);
  return solid;
}

}  // namespace cradle
