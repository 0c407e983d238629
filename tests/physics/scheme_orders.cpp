// The order of convergence of every scheme, measured against closed forms, or against another
// method at its rounding.
#include <catch2/catch.hpp>

#include "tests/physics/reference.h"
#include "tests/physics/schemes.h"

namespace cradle {
namespace {

constexpr double kTolerance = 0.05;

/// Steps of the coarse run: as many as bring a scheme of this order into its asymptotic range, and
/// not to rounding.
int steps_for(const Scheme& scheme, int first, int second, int fourth) {
  if (scheme.order == 1) return first;
  return scheme.order == 2 ? second : fourth;
}

void check_order(const Scheme& scheme, double measured) {
  CAPTURE(scheme.name, measured);
  CHECK(std::abs(measured - scheme.order) < kTolerance);
}

}  // namespace

TEST_CASE("orders: translation with linear drag, whose force depends on the velocity") {
  // v = e^(-ct) v0 + (1 - e^(-ct)) a / c, x its integral; c = 1, t = 2.
  FlightLoads loads;
  loads.drag.linear = 1;
  loads.force_W = {0.5, 0, -9.81};
  Flight start;
  start.v = {3, 4, 5};
  const double e = std::exp(-2.0);
  const Vector v = e * start.v + (1 - e) * loads.force_W;
  const Vector x = (1 - e) * start.v + (2 - (1 - e)) * loads.force_W;
  const auto error = [&](const Flight& end) { return (end.x - x).norm() + (end.v - v).norm(); };
  for (const Scheme& scheme : schemes()) {
    CAPTURE(scheme.name);
    if (scheme.advance == exact) {
      CHECK(error(run(scheme, start, {}, loads, 2, 1)) < 1e-13);
      CHECK(error(run(scheme, start, {}, loads, 2, 120)) < 1e-12);
    } else {
      check_order(scheme, measured_order(scheme, start, {}, loads, 2,
                                         steps_for(scheme, 512, 128, 64), error));
    }
  }
}

TEST_CASE("orders: translation with quadratic drag") {
  // In free fall from rest: v = vt tanh(g t / vt), x = vt^2 / g ln cosh(g t / vt); v0 at t0 = 1 s.
  constexpr double g = 9.81, vt = 20;
  FlightLoads loads;
  loads.drag.quadratic = g / (vt * vt);
  loads.force_W = {0, 0, -g};
  const auto at = [&](double t) {
    Flight body;
    body.v.z() = -vt * std::tanh(g * t / vt);
    body.x.z() = -vt * vt / g * std::log(std::cosh(g * t / vt));
    return body;
  };
  const Flight end = at(3);
  const auto error = [&](const Flight& body) {
    return (body.x - end.x).norm() + (body.v - end.v).norm();
  };
  for (const Scheme& scheme : schemes()) {
    check_order(scheme,
                measured_order(scheme, at(1), {}, loads, 2,
                               steps_for(scheme, 512, 128, scheme.order == 6 ? 10 : 32), error));
  }
}

TEST_CASE("orders: damped oscillator, a spring to the world") {
  // x'' + 2 d x' + w0^2 x = 0 with m = 1, k = 100, c = 2; a spring of rest length 1 m along x.
  const Anchor anchor{Vector::Zero(), {-1, 0, 0}, 100, 2, 1};
  FlightLoads loads;
  loads.anchors = std::span(&anchor, 1);
  Flight start;
  start.x = {0.1, 0, 0};
  const double d = 1, w = std::sqrt(100.0 - d * d), t = 1;
  const double decay = std::exp(-d * t) * 0.1;
  const double x = decay * (std::cos(w * t) + d / w * std::sin(w * t));
  const double v = -decay * (w + d * d / w) * std::sin(w * t);
  const auto error = [&](const Flight& end) {
    return std::abs(end.x.x() - x) * 10 + std::abs(end.v.x() - v);
  };
  for (const Scheme& scheme : schemes()) {
    const double measured =
        measured_order(scheme, start, {}, loads, t,
                       steps_for(scheme, 8192, 512, scheme.order == 6 ? 512 : 128), error);
    CAPTURE(scheme.name, measured);
    // exact moves springs by the energy-momentum method, of order 2.
    CHECK(std::abs(measured - (scheme.advance == exact ? 2 : scheme.order)) < kTolerance);
  }
}

TEST_CASE("orders: rotation without torque") {
  const Inertia inertia{1, {1, 2, 3}};
  Flight start;
  start.w = {1, 2, 3};
  const Flight end = reference::spin(start.w, inertia.moments, {}, 5, 100'000);
  for (const Scheme& scheme : schemes()) {
    // exact takes 0.13 rad a step: beyond 0.16 it would take two, below 0.06 only rounding is left.
    const int steps = scheme.order == 6 ? 143 : steps_for(scheme, 65536, 2048, 512);
    check_order(scheme, measured_order(scheme, start, inertia, {}, 5, steps,
                                       [&](const Flight& at) { return angle(at.q, end.q); }));
  }
}

TEST_CASE("orders: rotation with torques in W and in B, and angular drag") {
  const Inertia inertia{1, {1, 2, 3}};
  FlightLoads loads;
  loads.torque_W = {0.7, -0.4, 1.1};
  loads.torque_B = {-0.2, 0.3, 0.1};
  Flight start;
  start.w = {1, 2, 3};
  for (const auto& [drag, exact_steps] : {std::pair{0.0, 200}, {0.5, 150}}) {
    CAPTURE(drag);
    loads.drag.angular = drag;
    const Flight end = reference::spin(start.w, inertia.moments, loads, 4, 100'000);
    for (const Scheme& scheme : schemes()) {
      const int steps = scheme.order == 6 ? exact_steps : steps_for(scheme, 65536, 2048, 512);
      check_order(scheme,
                  measured_order(scheme, start, inertia, loads, 4, steps, [&](const Flight& at) {
                    return angle(at.q, end.q) + (at.w - end.w).norm();
                  }));
    }
  }
}

}  // namespace cradle
