#include "server/dynamics/contact/softness.h"

#include <numbers>

namespace cradle {
namespace {

/// Each with unit, reason, and the test that pins it.
struct SoftnessTolerances {
  double frequency = 0.177;  ///< c, of 1/h_c: at 0.25 of 1/h stacks rock ("stack of ten")
  double damping_ratio = 5;  ///< zeta: overlaps close without bouncing ("half overlapped")
};
constexpr SoftnessTolerances kSoftnessTolerances;

}  // namespace

double contact_angle() { return 2 * std::numbers::pi * kSoftnessTolerances.frequency; }

double give_of(int stiff_as, double dt) {
  const double h_c = dt / (stiff_as * contact_angle());
  return h_c * h_c;
}

Softness softness_of(double h, double h_c) {
  const double omega = contact_angle() / h_c;
  const double a1 = 2 * kSoftnessTolerances.damping_ratio + h * omega;
  const double a2 = h * omega * a1;
  return {a2 / (1 + a2), 1 / (1 + a2), omega / a1};
}

}  // namespace cradle
