/// The side of a body of revolution beside a rim: the normals of the side under which the rim is
/// nearest. Private to this folder.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace cradle {

/// Cosine and sine, of a half circle.
struct HalfAngle {
  double c, s;
};

/// Half way between two, which may be of other lengths.
inline HalfAngle between(const HalfAngle& a, const HalfAngle& b) {
  const double c = a.c + b.c, s = a.s + b.s, length2 = c * c + s * s;
  if (!(length2 > 0)) return {0, 1};
  const double scale = 1 / std::sqrt(length2);
  return {scale * c, scale * s};
}

inline HalfAngle at_cosine(double c) { return {c, std::sqrt(std::max(0.0, (1 - c) * (1 + c)))}; }

/// Over the normals at the angles phi, the overlap but for a constant: symbols in side_arc.cpp.
struct SideArc {
  double d_u, d_e;    ///< m, d_e not negative
  double r;           ///< m, radius of the rim
  double from, turn;  ///< the normal's share along the axis of the rim is from + turn cos phi

  double overlap(const HalfAngle& at) const;

  /// Lower bounds for cosines from `low` to `high`: by what the rim reaches at the ends, and by the
  /// point of the rim that is nearest from where the middle of the rim is nearest.
  double ends_bound(double low, double high) const;
  double point_bound(double low, double high, double up, double cosine) const;

  /// Where the overlap may be least for cosines from `low` to `high`: its local minima, which are
  /// two at most, or an end. Gives how many.
  std::size_t minima(double low, double high, std::array<HalfAngle, 2>& found) const;

 private:
  double to_u(const HalfAngle& at) const;  // the slope but for d_e, per sine
  double slope(const HalfAngle& at) const;
  HalfAngle least_between(HalfAngle begin, HalfAngle end) const;
};

}  // namespace cradle
