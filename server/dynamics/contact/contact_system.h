/// The contacts of a tick as equations between bodies, for the baselines: point by point, on the
/// lines of BodyLines (velocities, or displacements). In the frame n, t1, t2 of its contact:
///   u = E^T (vB - vA) + LB wB - LA wA,  L = -E^T [r]x T
/// with E = (n, t1, t2), r the arm and T the turn from the line's attitude to that for which the
/// arm holds. An impulse gives  v += E lambda / m, w += I^-1 L^T lambda  to B, and as much away
/// from A.
#pragma once

#include <vector>

#include "server/dynamics/contact/body_lines.h"
#include "server/dynamics/contact/coulomb_problem.h"
#include "server/dynamics/contact/tick_islands.h"

namespace cradle {

class ContactSystem {
 public:
  struct Side {
    std::int32_t line = 0;
    double inverse_mass = 0;  ///< 1/kg; 0: does not yield
    Matrix L, turn;           ///< turn = I^-1 L^T
  };
  struct Point {
    ContactConstraint* c;
    ConstraintPoint* p;
    Matrix E;
    Side A, B;
    Vector K;          ///< 1/kg, of the point by itself, along n, t1, t2
    Matrix inverse_K;  ///< kg, of the whole 3 x 3
    double bias;       ///< m/s, or m of displacements: un + bias >= 0
    bool acts;         ///< else there is no impulse at it
  };
  using Points = std::span<Point>;

  void begin(const ContactTick& tick, const BodyArrays& arrays,
             std::span<ContactConstraint* const> constraints, const BodyLines& bodies);

  std::size_t islands() const { return islands_.count(); }
  Points island(std::size_t i) {
    return std::span(points_).subspan(firsts_[i], firsts_[i + 1] - firsts_[i]);
  }
  Points points() { return points_; }
  /// Moving bodies.
  int bodies_of(std::size_t island) const { return sizes_[island]; }

  static Vector velocity(const Point& point, const BodyLine* lines);
  static void push(const Point& point, const Vector& impulse, BodyLine* lines);
  /// m, as the bodies have moved in the tick so far.
  static double separation(const Point& point, const BodyLines& bodies);
  /// Of these points, all of which act, with what the lines have now, and their biases.
  static CoulombProblem problem(Points points, const BodyLine* lines);

 private:
  TickIslands islands_;
  std::vector<Point> points_;        // by island
  std::vector<std::size_t> firsts_;  // of each island, and the end
  std::vector<int> sizes_;           // bodies, by island
};

}  // namespace cradle
