/// The search for the closest points of two cores, one support point at a time, so that several can
/// go on side by side: each waits long for its point. Private to this folder.
#pragma once

#include <array>
#include <cstdint>

#include "server/collision/convex_pair.h"

namespace cradle {

class ClosestSearch {
 public:
  /// Up to four corners, with B moved.
  struct Corners {
    std::array<Difference, 4> corners;
    std::size_t count = 0;
  };

  /// The point of a simplex closest to the origin, and the corners it is between, ascending.
  struct Foot {
    Vector v = Vector::Zero();
    std::array<std::uint8_t, 3> corners{};
    std::array<double, 3> weights{};
    std::uint8_t count = 0;
  };

  /// As for `closest`, with a simplex that is not empty, which must last.
  ClosestSearch(const Vector& shift, double limit, Simplex& simplex);

  bool is_done() const { return is_done_; }
  const Vector& direction() const { return direction_; }  ///< of the support point it waits for
  void take(Difference next);                             ///< that point
  const Closest& found() const { return found_; }         ///< once it is done

 private:
  void aim();
  void give_back();  // the simplex
  void end_apart();
  void end(const Closest& found) {
    found_ = found;
    is_done_ = true;
  }

  const Vector shift_;
  const double limit_;
  Simplex& simplex_;
  Corners s_;
  Foot foot_;
  double distance_ = 0, distance2_ = 0, largest_ = 0;
  int iteration_ = 0;
  bool is_done_ = false;
  Vector direction_;
  Closest found_;
};

}  // namespace cradle
