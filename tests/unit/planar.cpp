// What leaves the plane is refused by a planar world, by commands and in scenes.
#include "tests/physics/planar.h"

#include <catch2/catch.hpp>

#include "tests/unit/scene_helpers.h"

namespace cradle {
namespace {

using Catch::Matchers::Contains;

Result spawned(const BodySpec& spec) {
  World world(planar_settings({}));
  const auto before = world.hash();
  const Outcome outcome = world.spawn(std::array{ball(0.5, {}), spec});
  if (outcome.result == Result::ok) return outcome.result;
  CHECK(outcome.item == 1);
  CHECK(world.hash() == before);
  return outcome.result;
}

template <class Change>
Result spawned_with(Change&& change) {
  BodySpec spec = brick({0.1, 0.2, 0.3}, {1, 2, 0});
  change(spec);
  return spawned(spec);
}

Quat turned_about(double x, double y, double z, double angle_rad) {
  const double s = std::sin(angle_rad / 2);
  return {std::cos(angle_rad / 2), s * x, s * y, s * z};
}

}  // namespace

TEST_CASE("a planar world refuses bodies that leave the plane") {
  CHECK(spawned_with([](BodySpec&) {}) == Result::ok);
  CHECK(spawned_with([](BodySpec& b) { b.q_WB = about_z(2); }) == Result::ok);
  const auto refuses = [](auto&& change) {
    for (const BodyKind kind : {BodyKind::dynamic, BodyKind::kinematic, BodyKind::fixed}) {
      CHECK(spawned_with([&](BodySpec& b) {
              b.kind = kind;
              change(b);
            }) == Result::out_of_plane);
    }
  };
  refuses([](BodySpec& b) { b.p_WBo.z = 1e-9; });
  refuses([](BodySpec& b) { b.q_WB = turned_about(1, 0, 0, 0.1); });
  refuses([](BodySpec& b) { b.q_WB = turned_about(0, 1, 0, 1e-6); });
  CHECK(spawned_with([](BodySpec& b) { b.v_WBcm.z = 1; }) == Result::out_of_plane);
  CHECK(spawned_with([](BodySpec& b) { b.w_WB.x = 1; }) == Result::out_of_plane);
  CHECK(spawned_with([](BodySpec& b) { b.w_WB.y = 1; }) == Result::out_of_plane);
}

TEST_CASE("a planar world takes bodies with the centre in the plane and z a principal axis") {
  const auto with = [](const Vec3& centre, const Vec3& products) {
    return spawned_with([&](BodySpec& b) {
      b.sets_centre_of_mass = true;
      b.p_BoBcm = centre;
      b.inertia_kgm2 = {1, 1.2, 1.4};
      b.inertia_products_kgm2 = products;
    });
  };
  CHECK(with({0.1, -0.2, 0}, {0.3, 0, 0}) == Result::ok);
  CHECK(with({0, 0, 1e-3}, {}) == Result::out_of_plane);
  CHECK(with({}, {0, 1e-3, 0}) == Result::out_of_plane);
  CHECK(with({}, {0, 0, 1e-3}) == Result::out_of_plane);
  CHECK(spawned_with([](BodySpec& b) { b.shape = Shape::cylinder(1, 1); }) == Result::out_of_plane);
  CHECK(spawned_with([](BodySpec& b) { b.shape = Shape::cone(1, 1); }) == Result::out_of_plane);
}

TEST_CASE("the moment about z alone turns a body in the plane, wherever its principal axes are") {
  World world(planar_settings({}));
  BodySpec spec;
  spec.mass_kg = 2;
  spec.inertia_kgm2 = {1, 1.2, 1.4};
  spec.inertia_products_kgm2 = {0.3, 0, 0};
  Wrench twist;
  twist.body = add(world, spec);
  twist.quantity = WrenchQuantity::angular_impulse;
  twist.value = {0, 0, 7};
  REQUIRE(world.push(std::array{twist}).result == Result::ok);
  world.step();
  CHECK(state(world, twist.body).w_WB.z == Approx(5).epsilon(1e-15));
  CHECK(world.totals().kinetic_energy_J == Approx(1.4 * 25 / 2).epsilon(1e-15));
}

TEST_CASE("a half-space in a planar world has its normal in the plane") {
  BodySpec spec = ground();
  CHECK(spawned(spec) == Result::out_of_plane);
  spec.q_WB = turned_about(-1, 0, 0, 1.57);  // 8e-4 off
  CHECK(spawned(spec) == Result::out_of_plane);
  spec.q_WB = turned_about(-1, 0, 0, 1.5708);
  World world(planar_settings({}));
  const BodyState s = state(world, add(world, spec));
  const Vector normal = to_eigen(s.q_WB) * Vector::UnitZ();
  CHECK(std::abs(normal.z()) < 1e-15);
  CHECK(normal.y() == Approx(1).epsilon(1e-15));
  CHECK(turn_between(s.q_WB, spec.q_WB) < 1e-5);
}

TEST_CASE("a planar world refuses motions, wrenches, springs and gravity that leave the plane") {
  World world(planar_settings({}));
  const BodyId body = add(world, brick({0.1, 0.2, 0.3}, {}));
  const BodyId other = add(world, brick({0.1, 0.2, 0.3}, {3, 0, 0}));
  const auto before = world.hash();
  const auto moves = [&](auto&& change) {
    Motion motion;
    motion.body = body;
    motion.sets_pose = motion.sets_velocity = true;
    change(motion);
    return world.set_motion(std::array{motion}).result;
  };
  CHECK(moves([](Motion& m) { m.p_WBo.z = 1; }) == Result::out_of_plane);
  CHECK(moves([](Motion& m) { m.q_WB = turned_about(0, 1, 0, 0.1); }) == Result::out_of_plane);
  CHECK(moves([](Motion& m) { m.v_WBcm.z = 1; }) == Result::out_of_plane);
  CHECK(moves([](Motion& m) { m.w_WB.x = 1; }) == Result::out_of_plane);

  const auto pushes = [&](auto&& change) {
    Wrench wrench;
    wrench.body = body;
    change(wrench);
    return world.push(std::array{wrench}).result;
  };
  for (const WrenchFrame frame : {WrenchFrame::world, WrenchFrame::body}) {
    for (const WrenchQuantity quantity :
         {WrenchQuantity::force, WrenchQuantity::impulse, WrenchQuantity::acceleration}) {
      CHECK(pushes([&](Wrench& w) { w.frame = frame, w.quantity = quantity, w.value.z = 1; }) ==
            Result::out_of_plane);
    }
    for (const WrenchQuantity quantity :
         {WrenchQuantity::torque, WrenchQuantity::angular_impulse}) {
      CHECK(pushes([&](Wrench& w) { w.frame = frame, w.quantity = quantity, w.value.y = 1; }) ==
            Result::out_of_plane);
    }
  }
  CHECK(pushes([](Wrench& w) {
          w.value.x = 1;
          w.point_kind = WrenchPoint::body_point;
          w.point.z = 0.1;
        }) == Result::out_of_plane);

  Spring spring{body, other, {0, 0, 0.1}, {}, 1, 0, 0};
  CHECK(world.add_springs(std::array{spring}).result == Result::out_of_plane);
  CHECK(world.set_gravity({0, -9.81, -1e-9}).result == Result::out_of_plane);
  CHECK(world.hash() == before);
  CHECK(world.set_gravity({1, -9.81, 0}).result == Result::ok);
  CHECK(moves([](Motion& m) { m.v_WBcm = {1, 2, -0.0}, m.w_WB.z = 3; }) == Result::ok);
  CHECK(pushes([](Wrench& w) { w.value = {1, 1, 0}; }) == Result::ok);
  world.step();
  CHECK(is_in_plane(state(world, body)));
}

TEST_CASE("scenes choose a planar world") {
  CHECK_FALSE(scene_of("").settings.is_planar);
  CHECK(scene_of("[world]\nplanar = true\n").settings.is_planar);
  CHECK(scene_of("[world]\nplanar = true\n").settings.gravity_W == Vec3{0, -9.81, 0});
  CHECK_THAT(scene_refusal("[world]\nplanar = true\ngravity_mps2 = [0, 0, -9.81]\n"),
             Contains("x.toml:3: gravity_mps2: must have no z in a planar world"));
}

TEST_CASE("scenes name the body that leaves the plane, and why") {
  const std::string planar = "[world]\nplanar = true\n";
  const std::string ball = planar + "[[body]]\nname = 'ball'\nshape = 'sphere'\nradius_m = 1\n";
  CHECK(scene_refusal(ball).empty());
  CHECK_THAT(scene_refusal(ball + "position_m = [0, 0, 1]\n"),
             Contains("x.toml:3: its position in a planar world must have z = 0 (body \"ball\")"));
  CHECK_THAT(scene_refusal(ball + "rotation_rad = [0, 1, 0]\n"), Contains("its attitude"));
  CHECK_THAT(scene_refusal(ball + "velocity_mps = [0, 0, 1]\n"), Contains("its velocity"));
  CHECK_THAT(scene_refusal(ball + "angular_velocity_radps = [1, 0, 0]\n"),
             Contains("its angular velocity"));
  CHECK_THAT(scene_refusal(ball + "centre_of_mass_m = [0, 0, 0.1]\n"),
             Contains("its centre of mass"));
  CHECK_THAT(scene_refusal(ball + "[[body.wrench]]\nvalue = [0, 0, 1]\n"), Contains("a force"));
  CHECK_THAT(scene_refusal(ball + "[[spring]]\nbody_a = 'ball'\npoint_b_m = [0, 0, 1]\n"),
             Contains("its points"));
  CHECK_THAT(scene_refusal(planar + "[[body]]\nkind = 'static'\nshape = 'half_space'\n"),
             Contains("a half-space in a planar world has its normal, z in B, in the plane x, y "
                      "(body 1)"));
  CHECK_THAT(scene_refusal(planar + "[[lattice]]\ncount = [2, 1, 2]\npitch_m = [3, 3, 3]\n"
                                    "[[lattice.body]]\nshape = 'sphere'\nradius_m = 1\n"),
             Contains("its body number 2: its position"));
}

}  // namespace cradle
