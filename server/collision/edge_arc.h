/// How far an edge and a body of revolution overlap, over the arc of directions out of the edge.
/// Private to this folder.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "server/collision/geometry.h"

namespace cradle {

/// A cylinder or cone as two rims about an axis, of which the upper may be a point. Lengths in m.
struct Revolved {
  Vector axis;                       ///< unit
  Vector middle;                     ///< halfway between the middles of the rims
  double lower, upper, half_length;  ///< radii of the rims

  double radius(bool of_upper) const { return of_upper ? upper : lower; }
  Vector middle_of(bool of_upper) const {
    return middle + (of_upper ? half_length : -half_length) * axis;
  }
  /// Whether the point that is farthest against n is on the upper rim; n rises `along` the axis and
  /// `across` it.
  bool is_upper(double along, double across) const {
    return 2 * half_length * along + (lower - upper) * across < 0;
  }
  /// The point of a rim that is farthest against the unit vector n; the middle if n is along the
  /// axis but for rounding.
  Vector deepest(const Vector& n, bool of_upper) const {
    constexpr double kRounding = 1e-14;  // a sine
    const Vector out = n - n.dot(axis) * axis;
    // Twice: nearly along the axis the first leaves rounding, and 1 - (n . axis)^2 is nothing else.
    const Vector across = out - out.dot(axis) * axis;
    const double sine = across.norm();
    return middle_of(of_upper) - (sine > kRounding ? radius(of_upper) / sine : 0) * across;
  }
};

/// What has the point of the body that touches.
enum class Rim { lower, upper, side };

class EdgeArc {
 public:
  /// Of the edge at `p`, from the face with the unit normal m to that with n, whose cosine is given
  /// and not 1. Overlaps of `most` (m) and more do not count.
  EdgeArc(const Revolved& body, const Vector& p, const Vector& m, const Vector& n, double cosine,
          double most);

  /// False: there are none that count.
  bool find();

  double overlap() const { return best_; }  ///< m, the least
  Vector direction() const { return best_c_ * e_ + best_s_ * f_; }
  Rim rim() const { return rim_; }
  bool is_minimum() const { return is_minimum_; }  ///< that Newton's method has arrived at

 private:
  /// A direction c e + s f, and the overlap there with its derivatives.
  struct At {
    double c, s, h, slope, bend;
    bool is_minimum = false;
  };

  At at(double c, double s, bool of_upper) const;
  void take(const At& at, Rim rim);
  void cut_at_sides(double c_end, double s_end);
  void find_between(const At& from, const At& to, bool of_upper, int depth);
  At down(At from, At begin, At end, bool of_upper) const;

  const Vector e_, f_;  ///< unit; the arc begins at e and turns toward f
  const double end_c_, end_s_;
  const std::array<double, 2> radii_;
  const double half_length_, axis_e_, axis_f_, axis_along2_;  ///< the last: along the edge, squared
  std::array<double, 2> w_e_, w_f_;  ///< from the middle of each rim to the edge
  double best_, best_c_ = 1, best_s_ = 0;
  Rim rim_ = Rim::lower;
  bool has_found_ = false, is_minimum_ = false;
};

}  // namespace cradle
