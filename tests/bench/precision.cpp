#include "tests/bench/precision.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "server/stopwatch.h"
#include "tests/physics/reference.h"

namespace cradle::bench {
namespace {

constexpr double kGravity = 9.81;
constexpr double kTerminal_mps = 20;
constexpr double kLongestStep_s = 0.1;
constexpr double kFlightRounding = 1e-13;

/// The box of half extents 0.1, 0.2, 0.3 m and 1 kg.
const Inertia kBox{1, {0.13 / 3, 0.1 / 3, 0.05 / 3}};

Flight moving(const Vector& x, const Vector& v, const Vector& w) {
  Flight body;
  body.x = x;
  body.v = v;
  body.w = w;
  return body;
}

FlightLoads none() { return {}; }
FlightLoads weight() {
  FlightLoads loads;
  loads.force_W = {0, 0, -kGravity};
  return loads;
}
FlightLoads weight_and_drag() {
  FlightLoads loads = weight();
  loads.drag.quadratic = kGravity / (kTerminal_mps * kTerminal_mps);
  return loads;
}
FlightLoads spring() {
  static const Anchor anchor{Vector::Zero(), {-3, 0, 0}, 100, 0, 3};
  FlightLoads loads;
  loads.anchors = std::span(&anchor, 1);
  return loads;
}

Flight fly(const PrecisionCase& which, const Scheme& scheme, int steps, Work& work) {
  Flight body = which.start;
  const FlightLoads loads = which.loads();
  for (int i = 0; i < steps; ++i) {
    scheme.advance(body, which.inertia, loads, which.time_s / steps, work);
  }
  return body;
}

Flight end_of(const PrecisionCase& which, const Scheme& scheme, int steps) {
  Work work;
  return fly(which, scheme, steps, work);
}

double place(const PrecisionCase& which, const Scheme& scheme, int steps) {
  const double t = which.time_s;
  const Vector exact = which.start.v * t + Vector(0, 0, -kGravity) * (t * t / 2);
  return (end_of(which, scheme, steps).x - exact).norm();
}

/// Against RK4 in extended precision with 400 000 steps.
double attitude(const PrecisionCase& which, const Scheme& scheme, int steps) {
  const Rotation reference(-0.364863742986863, 0.023563357342589, 0.021262001052007,
                           -0.930519824912735);
  return 2 * (reference.conjugate() * end_of(which, scheme, steps).q).vec().norm();
}

/// The time of the last sign change of `spin` within the time, by halving the step it is in.
template <class Body, class Step, class Spin>
double last_flip(Body body, double time_s, int steps, Step&& step, Spin&& spin) {
  const double h = time_s / steps;
  double flip = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < steps; ++i) {
    const Body start = body;
    body = step(start, h);
    if (!(spin(start) * spin(body) < 0)) continue;
    double early = 0, late = h;
    while (late - early > 1e-14) {
      const double middle = (early + late) / 2;
      (spin(start) * spin(step(start, middle)) < 0 ? late : early) = middle;
    }
    flip = i * h + early;
  }
  return flip;
}

double flip_time(const PrecisionCase& which, const Scheme& scheme, int steps) {
  static const double reference_s = [&] {
    reference::Spin spin;
    spin.w = reference::longer(which.start.w);
    const reference::Long3 J = reference::longer(which.inertia.moments);
    return last_flip(
        spin, which.time_s, 100'000,
        [&](const reference::Spin& at, double h) { return reference::step(at, J, {}, h); },
        [](const reference::Spin& at) { return at.w[1]; });
  }();
  const double flip_s = last_flip(
      which.start, which.time_s, steps,
      [&](Flight at, double h) {
        Work work;
        scheme.advance(at, which.inertia, {}, h, work);
        return at;
      },
      [](const Flight& at) { return (at.q.conjugate() * at.w).y(); });
  return std::abs(flip_s - reference_s);
}

/// Distance in the plane of x and v / omega, by the amplitude.
double phase(const PrecisionCase& which, const Scheme& scheme, int steps) {
  const Flight end = end_of(which, scheme, steps);
  const double amplitude = which.start.x.x(), t = which.time_s;
  return std::hypot(end.x.x() - amplitude * std::cos(10 * t),
                    end.v.x() / 10 + amplitude * std::sin(10 * t)) /
         amplitude;
}

double fallen(const PrecisionCase& which, const Scheme& scheme, int steps) {
  const double vt = kTerminal_mps, s = kGravity * which.time_s / vt;
  return std::abs(end_of(which, scheme, steps).x.z() + vt * vt / kGravity * std::log(std::cosh(s)));
}

double measured_ns(const PrecisionCase& which, const Scheme& scheme, int steps) {
  constexpr int kRuns = 3;
  constexpr double kTimed_us = 1000;
  double best_us = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kRuns; ++i) {
    const Stopwatch stopwatch;
    int count = 0;
    do {
      end_of(which, scheme, steps);
      ++count;
    } while (stopwatch.elapsed_us() < kTimed_us);
    best_us = std::min(best_us, stopwatch.elapsed_us() / count);
  }
  return 1000 * best_us / which.time_s;
}

}  // namespace

std::span<const PrecisionCase> precision_cases() {
  static const std::array<PrecisionCase, 5> cases{{
      {"P01",
       "a projectile, 2 s",
       "position, m",
       2,
       {},
       moving({0, 0, 0}, {3, 4, 5}, {0, 0, 0}),
       weight,
       place},
      {"P07", "a box tumbles freely, 5 s", "attitude, rad", 5, kBox,
       moving({0, 0, 0}, {0, 0, 0}, {1, 2, 3}), none, attitude},
      {"P08", "a box flips about its middle axis", "time of the second flip, s", 10, kBox,
       moving({0, 0, 0}, {0, 0, 0}, {0.05, 5, 0.05}), none, flip_time},
      {"P09",
       "a mass on a spring, ten periods",
       "state, of the amplitude",
       6.283185307179586,
       {},
       moving({0.1, 0, 0}, {0, 0, 0}, {0, 0, 0}),
       spring,
       phase},
      {"P10",
       "a fall with quadratic drag, 3 s",
       "position, m",
       3,
       {},
       moving({0, 0, 0}, {0, 0, 0}, {0, 0, 0}),
       weight_and_drag,
       fallen},
  }};
  return cases;
}

std::vector<PrecisionCurve> sweep(const PrecisionCase& which, double evaluations_max) {
  std::vector<PrecisionCurve> curves;
  for (const Scheme& scheme : schemes()) {
    PrecisionCurve& curve = curves.emplace_back();
    curve.scheme = scheme.name;
    for (int steps = static_cast<int>(std::lround(which.time_s / kLongestStep_s));; steps *= 2) {
      Work work;
      fly(which, scheme, steps, work);
      if (static_cast<double>(work.evaluations) > evaluations_max) break;
      PrecisionPoint& point = curve.points.emplace_back();
      point.step_s = which.time_s / steps;
      point.error = which.error(which, scheme, steps);
      point.evaluations = static_cast<double>(work.evaluations) / which.time_s;
      point.ns = measured_ns(which, scheme, steps);
      if (point.error < kFlightRounding) break;
    }
  }
  return curves;
}

Cheapest cheapest(std::span<const PrecisionCurve> curves, double error) {
  Cheapest best;
  for (const PrecisionCurve& curve : curves) {
    for (const PrecisionPoint& point : curve.points) {
      if (!(point.error <= error)) continue;
      if (best.scheme.empty() || point.ns < best.point.ns) best = {curve.scheme, point};
    }
  }
  return best;
}

}  // namespace cradle::bench
