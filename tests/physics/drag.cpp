// Drag in the world against closed forms (P10), and how it behaves where it is stiff.
#include <catch2/catch.hpp>

#include "tests/physics/worlds.h"

namespace cradle {
namespace {

constexpr double kTerminal = 20;  // m/s
constexpr double kQuadratic = kGravity / (kTerminal * kTerminal);

BodyState fall(const Drag& drag, double time_s, const Vec3& v_WBcm = {}) {
  World world(settings());
  const BodyId body = add(world, ball(0.1, {}, v_WBcm));
  REQUIRE(world.set_drag(body, drag).result == Result::ok);
  steps(world, static_cast<int>(60 * time_s));
  return state(world, body);
}

}  // namespace

TEST_CASE("P10: drag brings a falling body to its terminal velocity") {
  // Quadratic: v = vt tanh(g t / vt), y = vt^2 / g ln cosh(g t / vt).
  const double s = kGravity * 3 / kTerminal;
  const BodyState quadratic = fall({0, kQuadratic, 0}, 3);
  CHECK(quadratic.v_WBcm.z == Approx(-17.997264).epsilon(1e-7));
  CHECK(quadratic.p_WBo.z == Approx(-33.831523).epsilon(1e-7));
  CHECK(std::abs(quadratic.v_WBcm.z + kTerminal * std::tanh(s)) < 1e-11);
  CHECK(std::abs(quadratic.p_WBo.z + std::log(std::cosh(s)) / kQuadratic) < 1e-11);
  // Linear: v = vt (1 - e^(-g t / vt)), y = vt t - vt v / g.
  const BodyState linear = fall({kGravity / kTerminal, 0, 0}, 3);
  const double v = kTerminal * (1 - std::exp(-s));
  CHECK(std::abs(linear.v_WBcm.z + v) < 1e-12);
  CHECK(std::abs(linear.p_WBo.z + kTerminal * 3 - kTerminal * v / kGravity) < 1e-11);
}

TEST_CASE("drag: thrown straight up, over the apex, where |v| v has a kink") {
  // Up: atan(v0 / vt) vt / g long, vt^2 / 2g ln(1 + v0^2 / vt^2) high; down as P10.
  constexpr double v0 = 15;
  const BodyState end = fall({0, kQuadratic, 0}, 3, {0, 0, v0});
  const double up_s = kTerminal / kGravity * std::atan(v0 / kTerminal);
  const double height = std::log(1 + v0 * v0 / (kTerminal * kTerminal)) / (2 * kQuadratic);
  const double s = kGravity * (3 - up_s) / kTerminal;
  CHECK(std::abs(end.v_WBcm.z + kTerminal * std::tanh(s)) < 1e-10);
  CHECK(std::abs(end.p_WBo.z - height + std::log(std::cosh(s)) / kQuadratic) < 1e-10);
}

TEST_CASE("drag: however strong, it ends at the terminal velocity and never beyond rest") {
  for (const double factor : {1e3, 1e6, 1e12}) {
    CAPTURE(factor);
    const BodyState linear = fall({kGravity * factor, 0, 0}, 1, {1e3, 0, 0});
    CHECK(linear.v_WBcm.z == Approx(-1 / factor).epsilon(1e-12));
    CHECK(std::abs(linear.v_WBcm.x) < 1e-12);
    const BodyState quadratic = fall({0, kGravity * factor, 0}, 1, {1e3, 0, 0});
    CHECK(quadratic.v_WBcm.z == Approx(-1 / std::sqrt(factor)).epsilon(1e-6));
    CHECK(quadratic.v_WBcm.x >= 0);
    CHECK(quadratic.v_WBcm.x < 1e-6);
    CHECK(quadratic.p_WBo.x < 1);
  }
}

TEST_CASE("drag: angular drag stops a spin by its exponential") {
  for (const double strength : {0.05, 5.0, 1e9}) {
    World world(weightless());
    BodySpec spec = ball(0.5, {});  // J = 0.1
    spec.w_WB = {0, 3, 0};
    const BodyId body = add(world, spec);
    REQUIRE(world.set_drag(body, {0, 0, strength}).result == Result::ok);
    steps(world, 6);
    const double w = 3 * std::exp(-0.1 * strength / 0.1);
    CHECK(state(world, body).w_WB.y == Approx(w).epsilon(1e-9).margin(1e-12));
  }
}

TEST_CASE("drag: a box that slides without friction slows down by its exponential") {
  World world(settings());
  add(world, ground(0));
  const BodyId box = add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0.5}, {3, 0, 0}));
  REQUIRE(world.set_drag(box, {0.7, 0, 0}).result == Result::ok);
  steps(world, 60);
  CHECK(state(world, box).in_contact);
  CHECK(state(world, box).v_WBcm.x == Approx(3 * std::exp(-0.7)).epsilon(1e-3));
  // However strong, it does not push back.
  REQUIRE(world.set_drag(box, {1e12, 1e12, 1e12}).result == Result::ok);
  steps(world, 60);
  CHECK(norm(state(world, box).v_WBcm) < 1e-3);
}

}  // namespace cradle
