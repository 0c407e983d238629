#include "server/collision/lead.h"

#include <algorithm>
#include <cmath>

namespace cradle {
namespace {

constexpr double kTurn = 1e-3;         // rad, that a direction may turn by at most, about
constexpr double kSamePlace2 = 1e-18;  // m^2: points of B come back from A's frame with rounding

bool is_one(const Vector& p, const Vector& q) { return (p - q).squaredNorm() < kSamePlace2; }

/// How far the foot is inside its triangle.
double inside_triangle(const Simplex& simplex) {
  const auto& w = simplex.corners;
  const double area = (w[1].w - w[0].w).cross(w[2].w - w[0].w).norm();
  double inside = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const double side = (w[(i + 1) % 3].w - w[(i + 2) % 3].w).norm();
    inside = std::min(inside, simplex.weights[i] * area / side);
  }
  return inside;
}

}  // namespace

double edge_sine(std::span<const Difference> corners) {
  // The longest ways from corner to corner, of A and of B; where three corners of one are in a
  // triangle, that is what carries.
  Vector along_A = Vector::Zero(), along_B = Vector::Zero();
  int steps_A = 0, steps_B = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Difference &p = corners[i], &q = corners[(i + 1) % 3];
    const Vector a = q.a - p.a, b = (q.a - q.w) - (p.a - p.w);
    if (!is_one(q.a, p.a)) along_A = a, ++steps_A;
    if (!is_one(q.a - q.w, p.a - p.w)) along_B = b, ++steps_B;
  }
  // One step is none: two that are the same way there and back, or three around.
  if (steps_A != 2 || steps_B != 2) return 1;
  return along_A.cross(along_B).norm() / (along_A.norm() * along_B.norm());
}

double lead_by_turn(double distance) { return kTurn * distance; }

double lead_of_closest(const Simplex& simplex, double distance) {
  const double by_turn = lead_by_turn(distance);
  if (simplex.count < 3) return by_turn;
  return std::max(by_turn, inside_triangle(simplex));
}

}  // namespace cradle
