// Newton's method with line search.
//
// Source: Nocedal and Wright (2006), chapter 3; Dowell and Jarratt (1971) for the search
// ("Illinois"), on the slope along the direction, which rises monotonously.
//   H d = -r;  x += a d,  a = 1 where |f'(1)| <= 0.1 |f'(0)|, else f'(a) = 0 to 2 % of f'(0)
//
// Order: the minimum, to the tolerance; the function is piecewise smooth, so it is exact as soon as
// no point changes between sticking and open. Cost: an iteration is a factor (block_cholesky.cpp)
// and two to four passes over all points.
#include "server/dynamics/contact/newton/minimise.h"

#include <cmath>

namespace cradle {
namespace {

constexpr double kWhole = 0.1;    ///< of the slope: a whole step leaves no more
constexpr double kEnough = 0.02;  ///< likewise, the search
constexpr int kSearches = 40;
constexpr double kLongestStep = 64;  ///< steps

}  // namespace

/// Of the direction d_.
double Minimiser::part_of(const ContactIsland& island, const Eigen::VectorXd& x) const {
  const double rest = d_.dot(x - island.free()), square = d_.squaredNorm();
  const auto slope = [&](double part) {
    return rest + part * square + island.slope_of_contacts(part);
  };
  const double first = std::abs(r_.dot(d_));
  double low = 0, slope_low = -first, high = 1, slope_high = slope(1);
  if (std::abs(slope_high) <= kWhole * first) return 1;
  while (slope_high < 0 && high < kLongestStep) {
    low = high;
    slope_low = slope_high;
    slope_high = slope(high *= 2);
  }
  double part = high;
  int side = 0;
  for (int k = 0; k < kSearches && slope_high > 0; ++k) {
    part = (low * slope_high - high * slope_low) / (slope_high - slope_low);
    const double now = slope(part);
    if (std::abs(now) <= kEnough * first) break;
    if (now > 0) {
      high = part;
      slope_high = now;
      if (side > 0) slope_low /= 2;
      side = 1;
    } else {
      low = part;
      slope_low = now;
      if (side < 0) slope_high /= 2;
      side = -1;
    }
  }
  return part;
}

double Minimiser::error(ContactIsland& island, const Eigen::VectorXd& x) {
  island.look(x);
  island.gradient(x, r_);
  return r_.norm();
}

Minimum Minimiser::minimise(ContactIsland& island, BlockCholesky& H, Eigen::VectorXd& x,
                            const MinimiseSettings& settings) {
  Minimum minimum;
  for (;; ++minimum.iterations) {
    island.gradient(x, r_);
    minimum.is_found = r_.norm() <= settings.tolerance * settings.scale;
    if (minimum.is_found || minimum.iterations == settings.iterations_max) return minimum;
    island.assemble(H, minimum.iterations == 0);
    if (!H.factor()) return minimum;
    d_ = -r_;
    H.solve(d_);
    island.look_along(d_);
    const double part = part_of(island, x);
    x += part * d_;
    island.go(part);
  }
}

}  // namespace cradle
