// The whole table of wrenches: quantity x frame x point x duration, against rigid body mechanics
// written out by hand.
#include <catch2/catch.hpp>

#include "tests/physics/worlds.h"

namespace cradle {
namespace {

constexpr double kMass = 2;
constexpr Vec3 kInertia{1, 2, 2.5};
// A quarter turn about z: B's x axis is W's y axis, B's y is W's -x.
const Quat kQuarter{std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
Vec3 turned(const Vec3& v) { return {-v.y, v.x, v.z}; }
Vec3 turned_back(const Vec3& v) { return {v.y, -v.x, v.z}; }
Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Vec3 scaled(const Vec3& v, double f) { return {f * v.x, f * v.y, f * v.z}; }

/// The body of the table: at (1, 2, 3) m, at rest, turned by a quarter.
BodySpec subject() {
  BodySpec spec;
  spec.mass_kg = kMass;
  spec.inertia_kgm2 = kInertia;
  spec.p_WBo = {1, 2, 3};
  spec.q_WB = kQuarter;
  return spec;
}

bool is_moment(WrenchQuantity q) {
  return q == WrenchQuantity::torque || q == WrenchQuantity::angular_impulse;
}
bool is_impulse(WrenchQuantity q) {
  return q == WrenchQuantity::impulse || q == WrenchQuantity::angular_impulse;
}

}  // namespace

TEST_CASE("every wrench of the table changes the velocities by what mechanics says") {
  const double dt = 1e-4;  // so short that the turning within the tick is below the tolerance
  for (int quantity = 0; quantity <= 4; ++quantity) {
    for (int frame = 0; frame <= 1; ++frame) {
      for (int point_kind = 0; point_kind <= 2; ++point_kind) {
        Wrench wrench;
        wrench.quantity = static_cast<WrenchQuantity>(quantity);
        wrench.frame = static_cast<WrenchFrame>(frame);
        wrench.point_kind = static_cast<WrenchPoint>(point_kind);
        if (is_moment(wrench.quantity) && point_kind != 0) continue;  // no such wrench
        wrench.value = {0.3, -0.5, 0.7};
        if (point_kind == 1) wrench.point = {1.5, 2.25, 2};
        if (point_kind == 2) wrench.point = {0.5, 0.25, -1};
        CAPTURE(quantity, frame, point_kind);

        World world(weightless(1 / dt));
        wrench.body = add(world, subject());
        REQUIRE(world.push(std::array{wrench}).result == Result::ok);
        world.step();
        const BodyState s = state(world, wrench.body);

        // By hand: force and torque in W about Bcm, then v = F t / m and J w = T t in B.
        Vec3 value = frame == 1 ? turned(wrench.value) : wrench.value;
        if (wrench.quantity == WrenchQuantity::acceleration) value = scaled(value, kMass);
        Vec3 arm;
        if (point_kind == 1) arm = {0.5, 0.25, -1};
        if (point_kind == 2) arm = turned(wrench.point);
        const double time = is_impulse(wrench.quantity) ? 1 : dt;
        const Vec3 linear = is_moment(wrench.quantity) ? Vec3{} : scaled(value, time);
        const Vec3 angular = scaled(is_moment(wrench.quantity) ? value : cross(arm, value), time);
        const Vec3 in_B = turned_back(angular);
        const Vec3 w = turned({in_B.x / kInertia.x, in_B.y / kInertia.y, in_B.z / kInertia.z});

        CHECK(distance(s.v_WBcm, scaled(linear, 1 / kMass)) < 1e-12);
        // The turning within the tick changes w by about (w dt)^2 and the gyroscopic term.
        CHECK(distance(s.w_WB, w) < 1e-4 * norm(w) + 1e-12);
      }
    }
  }
}

TEST_CASE("an impulse at the centre moves the body from the tick's start, a force through it") {
  const double dt = 1.0 / 60;
  World world(weightless());
  const BodyId kicked = add(world, subject());
  const BodyId pushed = add(world, subject());
  Wrench impulse;
  impulse.body = kicked;
  impulse.quantity = WrenchQuantity::impulse;
  impulse.value = {1, 0, 0};
  Wrench force;
  force.body = pushed;
  force.value = {1 / dt, 0, 0};
  REQUIRE(world.push(std::array{impulse, force}).result == Result::ok);
  world.step();
  CHECK(state(world, kicked).p_WBo.x - 1 == Approx(dt / kMass).epsilon(1e-12));
  CHECK(state(world, pushed).p_WBo.x - 1 == Approx(dt / kMass / 2).epsilon(1e-12));
}

TEST_CASE("wrenches last this tick, a number of ticks, or until they are cleared") {
  for (const auto& [duration, ticks, acts] :
       {std::tuple{WrenchDuration::this_tick, 0, 1}, std::tuple{WrenchDuration::ticks, 7, 7},
        std::tuple{WrenchDuration::until_cleared, 0, 10}}) {
    World world(weightless());
    Wrench wrench;
    wrench.body = add(world, subject());
    wrench.value = {60 * kMass, 0, 0};  // 1 m/s a tick
    wrench.duration = duration;
    wrench.ticks = ticks;
    REQUIRE(world.push(std::array{wrench}).result == Result::ok);
    steps(world, 10);
    world.clear_wrenches(std::array{wrench.body});
    CHECK(world.wrench_count() == 0);
    steps(world, 10);
    CHECK(state(world, wrench.body).v_WBcm.x == Approx(acts).epsilon(1e-13));
  }
}

TEST_CASE("a torque in the body's frame turns with the body within the tick") {
  // A round body keeps w_B = w0 + tau t / J; it makes 13 turns here. A torque that is turned only
  // at each tick's start would miss by a percent.
  World world(weightless());
  BodySpec spec;
  spec.mass_kg = 1;
  spec.inertia_kgm2 = {2, 2, 2};
  spec.w_WB = {0, 0, 80};
  Wrench twist;
  twist.body = add(world, spec);
  twist.quantity = WrenchQuantity::torque;
  twist.frame = WrenchFrame::body;
  twist.value = {6, 0, 0};
  twist.duration = WrenchDuration::until_cleared;
  REQUIRE(world.push(std::array{twist}).result == Result::ok);
  steps(world, 60);
  const BodyState s = state(world, twist.body);
  CHECK(norm(s.w_WB) == Approx(std::sqrt(80 * 80 + 3 * 3)).epsilon(1e-10));
  // Seen from the body: (3, 0, 80) rad/s; q^-1 w q by hand.
  const auto [w, x, y, z] = s.q_WB;
  const Vec3 own_x{1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)};
  const Vec3 own_y{2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)};
  const auto dot = [](const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
  CHECK(dot(own_x, s.w_WB) == Approx(3).epsilon(1e-9));
  CHECK(std::abs(dot(own_y, s.w_WB)) < 1e-9);
}

TEST_CASE("a body point and a body frame turn with the body") {
  // Thrust along B's y at B's x = 1 m keeps turning the body faster about z and its path curls:
  // with J = 1, T = 1 the angle is t^2 / 2.
  World world(weightless(6000));
  BodySpec spec;
  spec.mass_kg = 1;
  spec.inertia_kgm2 = {1, 1, 1};
  Wrench thrust;
  thrust.body = add(world, spec);
  thrust.frame = WrenchFrame::body;
  thrust.point_kind = WrenchPoint::body_point;
  thrust.point = {1, 0, 0};
  thrust.value = {0, 1, 0};
  thrust.duration = WrenchDuration::until_cleared;
  REQUIRE(world.push(std::array{thrust}).result == Result::ok);
  steps(world, 6000);
  const BodyState s = state(world, thrust.body);
  CHECK(s.w_WB.z == Approx(1).epsilon(1e-9));
  // v = integral of (-sin(t^2/2), cos(t^2/2)) over 0..1 s: series of the Fresnel integrals,
  // sum (-1)^k / ((2k+1)! 2^(2k+1) (4k+3)) and sum (-1)^k / ((2k)! 2^(2k) (4k+1)).
  const double sine = 1.0 / 6 - 1.0 / 336 + 1.0 / 42240 - 1.0 / 9676800;
  const double cosine = 1 - 1.0 / 40 + 1.0 / 3456 - 1.0 / 599040;
  CHECK(s.v_WBcm.x == Approx(-sine).epsilon(1e-3));
  CHECK(s.v_WBcm.y == Approx(cosine).epsilon(1e-3));
}

}  // namespace cradle
