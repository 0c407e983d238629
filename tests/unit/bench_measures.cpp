// The benchmark's measures on trajectories made by hand: the exact ones have no error, wrong ones
// the error that they were given.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>

#include "tests/bench/run.h"

using namespace cradle;
using namespace cradle::bench;

namespace {

constexpr double kFarBelow = 1e-9;  // far below the errors looked for
constexpr double kG_mps2 = 9.81;
constexpr double kDt_s = 1.0 / 60;
constexpr double kBodyTicks = 250'000;  // the larger scenes are watched for less time

/// Where the bodies of a scene are at a time; what it leaves alone stays where it began.
using Trajectory = std::function<void(double time_s, std::vector<BodyState>& states)>;

/// The error that a case finds in a course.
double error_of(std::string_view name, const Trajectory& motion) {
  const Case& which = *find_case(name);
  const Scene scene = scene_of(which);
  std::vector<BodyState> start;
  for (const BodySpec& body : scene.bodies) {
    BodyState& state = start.emplace_back();
    state.p_WBo = body.p_WBo;
    state.q_WB = body.q_WB;
    state.v_WBcm = body.v_WBcm;
    state.w_WB = body.w_WB;
  }
  const auto measure = which.measure(scene);
  const bool looks_at_overlaps =
      which.measure == mean_penetration_at_end || which.measure == mean_square_overlap;
  PenetrationCheck check(scene);
  const auto body_ticks = std::max(2.0, kBodyTicks / static_cast<double>(scene.bodies.size()));
  const auto ticks = std::lround(std::min(which.duration_s / kDt_s, body_ticks));
  for (long tick = 1; tick <= ticks; ++tick) {
    const double time_s = static_cast<double>(tick) * kDt_s;
    std::vector<BodyState> states = start;
    motion(time_s, states);
    measure->tick({time_s, states, looks_at_overlaps ? check.look(states) : Penetration{}});
  }
  return measure->error();
}

/// Height and speed of what falls from `height` and keeps `e` of its speed at each bounce.
std::pair<double, double> bouncing(double time_s, double height, double e) {
  double landing_s = std::sqrt(2 * height / kG_mps2);
  if (time_s < landing_s) return {height - kG_mps2 * time_s * time_s / 2, -kG_mps2 * time_s};
  if (e == 0) return {0, 0};
  double up = e * kG_mps2 * landing_s;
  while (time_s > landing_s + 2 * up / kG_mps2) {
    landing_s += 2 * up / kG_mps2;
    up *= e;
  }
  const double t = time_s - landing_s;
  return {up * t - kG_mps2 * t * t / 2, up - kG_mps2 * t};
}

Trajectory bouncing_sphere(double e) {
  return [e](double t, std::vector<BodyState>& states) {
    const auto [z, v] = bouncing(t, 10, e);
    states[1].p_WBo.z = 0.5 + z;
    states[1].v_WBcm.z = v;
  };
}

/// Slides at 10 m/s under mu = 0.3 until it rolls; radius 0.5 m.
Trajectory rolling_sphere(double mu) {
  return [mu](double t, std::vector<BodyState>& states) {
    const double slip_end_s = 20 / (7 * mu * kG_mps2);
    const double slide_s = std::min(t, slip_end_s);
    states[1].v_WBcm.x = 10 - mu * kG_mps2 * slide_s;
    states[1].w_WB.y = 2.5 * mu * kG_mps2 / 0.5 * slide_s;  // J = 2/5 m r^2
  };
}

/// Down a slope of tan = 0.6, whose downhill is (cos, 0, -sin).
Trajectory down_the_slope(const std::function<double(double)>& way) {
  return [way](double t, std::vector<BodyState>& states) {
    const double cosine = 1 / std::sqrt(1.36);
    states[1].p_WBo.x += way(t) * cosine;
    states[1].p_WBo.z -= way(t) * 0.6 * cosine;
  };
}

Trajectory final_speeds(const std::vector<double>& speeds) {
  return [speeds](double, std::vector<BodyState>& states) {
    for (std::size_t i = 0; i < speeds.size(); ++i) states[i].v_WBcm = {speeds[i], 0, 0};
  };
}

Trajectory faster(double factor) {
  return [factor](double, std::vector<BodyState>& states) {
    for (BodyState& s : states) {
      s.v_WBcm = to_plain(factor * to_eigen(s.v_WBcm));
      s.w_WB = to_plain(factor * to_eigen(s.w_WB));
    }
  };
}

void at_rest(double, std::vector<BodyState>&) {}

}  // namespace

TEST_CASE("a parabola has no error, that of semi-implicit Euler half a tick of fall") {
  const auto parabola = [](double behind) -> Trajectory {
    return [behind](double t, std::vector<BodyState>& states) {
      states[0].p_WBo = {10 * t, 0, 50 * t - kG_mps2 * t * (t + behind) / 2};
    };
  };
  CHECK(error_of("A1", parabola(0)) < kFarBelow);
  // x_n = v0 t - g t (t + dt) / 2: 0.8175 m after 10 s; Bullet and ODE have 0.82.
  CHECK(error_of("A1", parabola(kDt_s)) == Approx(0.8175));
}

TEST_CASE("a tumbling body that turns too fast or too far is caught") {
  CHECK(error_of("A2", at_rest) < kFarBelow);
  // Energy goes with the square of the speed, and counts more than the momentum here.
  CHECK(error_of("A2", faster(1.01)) == Approx(1.01 * 1.01 - 1));
  // Body and rates turned together by 0.1 rad about x: the momentum, nearly along y, turns too and
  // the energy stays. The chord of 0.1 rad.
  const Trajectory turned = [](double, std::vector<BodyState>& states) {
    const Rotation turn(Eigen::AngleAxisd(0.1, Vector::UnitX()));
    states[0].q_WB = to_plain(turn);
    states[0].w_WB = to_plain(turn * to_eigen(states[0].w_WB));
  };
  CHECK(error_of("A2", turned) == Approx(2 * std::sin(0.05)).epsilon(1e-5));
}

TEST_CASE("rotational energy is counted alone") {
  CHECK(error_of("T4", at_rest) < kFarBelow);
  CHECK(error_of("T4", faster(1.01)) == Approx(1.01 * 1.01 - 1));
  const Trajectory moved = [](double, std::vector<BodyState>& states) {
    for (BodyState& s : states) s.v_WBcm.x += 1;
  };
  CHECK(error_of("T4", moved) < kFarBelow);
}

TEST_CASE("apexes that are right have no error by energy, and by poses that of the sampling") {
  CHECK(error_of("A3e", bouncing_sphere(0.8)) < kFarBelow);
  // Half a tick from the fifth apex it is g (dt/2)^2 / 2 lower.
  const double sampling = kG_mps2 * kDt_s * kDt_s / 8 / (10 * std::pow(0.64, 5));
  const double by_poses = error_of("A3", bouncing_sphere(0.8));
  CHECK(by_poses > 0);
  CHECK(by_poses < sampling);
}

TEST_CASE("apexes of a wrong restitution are wrong by its square, five times over") {
  const double expected = std::pow(0.81 * 0.81 / 0.64, 5) - 1;
  CHECK(error_of("A3e", bouncing_sphere(0.81)) == Approx(expected));
  CHECK(error_of("A3", bouncing_sphere(0.81)) == Approx(expected).margin(1e-3));
}

TEST_CASE("a sphere that does not bounce misses its apexes wholly") {
  CHECK(error_of("A3", bouncing_sphere(0)) == 1);
  CHECK(error_of("A3e", bouncing_sphere(0)) == 1);
}

TEST_CASE("kinetic energy that is lost counts like energy that is gained") {
  for (const char* name : {"T1", "A11"}) {
    CHECK(error_of(name, at_rest) < kFarBelow);
    CHECK(error_of(name, faster(1.1)) == Approx(1.1 * 1.1 - 1));
    CHECK(error_of(name, faster(0.9)) == Approx(1 - 0.9 * 0.9));
  }
}

TEST_CASE(
    "a box that stops where Coulomb says has no error, semi-implicit Euler half a tick's way") {
  const double a = 0.5 * kG_mps2;
  CHECK(error_of("A4", [a](double t, std::vector<BodyState>& states) {
          t = std::min(t, 10 / a);
          states[1].p_WBo.x = 10 * t - a * t * t / 2;
        }) < kFarBelow);
  double v = 10;
  double x = 0;
  const Trajectory euler = [&](double, std::vector<BodyState>& states) {
    v = std::max(0.0, v - a * kDt_s);
    x += v * kDt_s;
    states[1].p_WBo.x = x;
  };
  // a dt / v0 = 8.2e-3, as of engines that step so.
  CHECK(error_of("A4", euler) == Approx(8.2e-3).epsilon(0.01));
}

TEST_CASE("a box that leaves its straight line has not stopped where it should") {
  const double distance = 100 / kG_mps2;  // v0^2 / (2 mu g)
  CHECK(error_of("A4", [&](double, std::vector<BodyState>& states) {
          states[1].p_WBo.x = distance;
          states[1].p_WBo.y = 0.01 * distance;
        }) == Approx(0.01));
}

TEST_CASE("a sphere rolls at five sevenths after the time that its friction gives") {
  CHECK(error_of("A5", rolling_sphere(0.3)) < kFarBelow);
  CHECK(error_of("A5t", rolling_sphere(0.3)) < kFarBelow);
  // The final speed does not depend on the friction, the time goes with its inverse.
  CHECK(error_of("A5", rolling_sphere(0.33)) < kFarBelow);
  CHECK(error_of("A5t", rolling_sphere(0.33)) == Approx(1 - 1 / 1.1));
  CHECK(error_of("A5", final_speeds({0, 7})) == Approx(0.02));  // 7 instead of 50/7
}

TEST_CASE("a cube that rests on a slope does not creep") {
  CHECK(error_of("A6a", at_rest) == 0);
  CHECK(error_of("A6a", down_the_slope([](double t) { return 1e-3 * t; })) == Approx(1e-3));
}

TEST_CASE("a cube slides down a slope as sine and friction say") {
  // g (sin - mu cos) with tan = 0.6 and mu = 0.5.
  const double a = kG_mps2 * (0.6 - 0.5) / std::sqrt(1.36);
  const auto slides = [](double acceleration) {
    return down_the_slope([=](double t) { return acceleration * t * t / 2; });
  };
  CHECK(error_of("A6b", slides(a)) < kFarBelow);
  CHECK(error_of("A6b", slides(1.03 * a)) == Approx(0.03));
  CHECK(error_of("A6b", at_rest) == Approx(1));
}

TEST_CASE("a stack's drift is horizontal, a pyramid's displacement is in every direction") {
  const Trajectory moved = [](double t, std::vector<BodyState>& states) {
    if (std::abs(t - 0.5) > kDt_s / 2) return;  // at one tick only
    states[3].p_WBo.x += 3e-4;
    states[3].p_WBo.z -= 4e-4;
  };
  CHECK(error_of("A7", moved) == Approx(3e-4));
  CHECK(error_of("T3", moved) == Approx(5e-4));
  CHECK(error_of("A8b", moved) == Approx(5e-4));
}

TEST_CASE("a pile is as wrong as its mean overlap at the end") {
  // Two cubes put into each other by 0.1 m at the end, by 0.4 m before; the rest far from all.
  const Trajectory overlapping = [](double t, std::vector<BodyState>& states) {
    const double overlap = t < 1 ? 0.4 : 0.1;
    states[5].p_WBo = {0, 0, 100};
    states[6].p_WBo = {1 - overlap, 0, 100};
    states[5].q_WB = states[6].q_WB = Quat{};
  };
  CHECK(error_of("T2", at_rest) == 0);
  CHECK(error_of("T2", overlapping) == Approx(0.1));
}

TEST_CASE("a cradle sends out as many as came") {
  CHECK(error_of("A9", final_speeds({0, 0, 0, 0, 1})) == 0);
  CHECK(error_of("A9b", final_speeds({0, 0, 0, 1, 1})) == 0);
  // What Jolt does with one, what a simultaneous solve does with two.
  CHECK(error_of("A9", final_speeds({-.59, .38, .40, .40, .40})) == Approx(0.6));
  CHECK(error_of("A9b", final_speeds({-.2, -.2, .8, .8, .8})) == Approx(0.8));
}

TEST_CASE("a sphere must be stopped on its own side of a wall") {
  const auto ends = [](double x, double v) -> Trajectory {
    return [=](double t, std::vector<BodyState>& states) { states[1].p_WBo.x = x + v * t; };
  };
  CHECK(error_of("A10", ends(-0.06, 0)) < kFarBelow);
  CHECK(error_of("A10", ends(-0.07, 0)) == 0);
  CHECK(error_of("A10", ends(-0.05, 0)) == Approx(0.01));
  CHECK(error_of("A10", ends(-5, 1000)) > 100);
  CHECK(error_of("A10", ends(-0.06, -10)) > 1);  // thrown back
}

TEST_CASE("cubes that part are as wrong as they were fast") {
  CHECK(error_of("A12", at_rest) == 0);
  CHECK(error_of("A12", [](double t, std::vector<BodyState>& states) {
          if (t < 0.5) states[1].v_WBcm = {0.3, 0.4, 0};
        }) == Approx(0.5));
}

TEST_CASE("a box pulled from under spheres is as wrong as its and their velocities") {
  // 150 N less the ground's 137.34, of 10 kg with 25 spheres of 1 kg that roll on it.
  const auto accelerating = [](double box_mps2, double ball_mps2, double x, double y) {
    return Trajectory([=](double t, std::vector<BodyState>& states) {
      states[1].v_WBcm = {box_mps2 * t * x, box_mps2 * t * y, 0};
      states[2].v_WBcm = {ball_mps2 * t * x, ball_mps2 * t * y, 0};
    });
  };
  const double f = 12.66 / 10 / (3.5 + 2.5), a = (12.66 - 25 * f) / 10;
  CHECK(a == Approx(0.7385));
  CHECK(error_of("S1", accelerating(a, f, 0, 1)) < kFarBelow);
  CHECK(error_of("S1t", accelerating(a, f, 0.5, std::sqrt(0.75))) < kFarBelow);
  CHECK(error_of("S1t", accelerating(a, f, 0, 1)) > 0.1);
  CHECK(error_of("S1", at_rest) == Approx(3.146).epsilon(0.01));  // SimBenchmark's of no motion
}

TEST_CASE("mean squares of energies and overlaps are those of what was made") {
  const auto lifted = [](double, std::vector<BodyState>& states) { states[1].p_WBo.z += 0.1; };
  CHECK(error_of("S2", at_rest) == 0);
  CHECK(error_of("S2", lifted) == Approx(9.81 * 9.81));
  CHECK(error_of("S4", lifted) == Approx(9.81 * 9.81));
  CHECK(error_of("S3", at_rest) == 0);
  CHECK(error_of("S3", [](double, std::vector<BodyState>& states) {
          states[2].p_WBo = states[1].p_WBo;
          states[2].p_WBo.x += 0.19;
          states[100].p_WBo = {50, 50, 0.07};  // in the ground
        }) == Approx(1e-4 + 9e-4));
}

TEST_CASE("no measure drops what is not a number") {
  const Trajectory broken = [](double t, std::vector<BodyState>& states) {
    if (t < 1.5 * kDt_s) return;
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    for (BodyState& state : states) state.p_WBo.x = state.p_WBo.z = state.v_WBcm.x = nan;
    for (BodyState& state : states) state.w_WB.x = nan;
  };
  for (const Case& one : cases()) {
    INFO(one.name);
    CHECK(std::isnan(error_of(one.name, broken)));
  }
}
