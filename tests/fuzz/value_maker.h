/// Makes what commands speak of from a fuzzer's bytes: bodies, wrenches, motions, with numbers at
/// and beyond their limits.
#pragma once

#include <cradle/limits.h>

#include <array>
#include <limits>
#include <string>

#include "tests/fuzz/input.h"

namespace cradle::fuzz {

class ValueMaker {
 public:
  /// `is_tame`: one number in sixteen, at most, is not small and even.
  ValueMaker(Input& input, bool is_tame) : in_(input), is_tame_(is_tame) {}

  std::int64_t integer() { return in_.any<std::int64_t>() & limits::kIntegerMax; }
  BodyId body_id() {
    return {in_.one_in(16) ? integer() : 1 + static_cast<std::int64_t>(in_.below(16))};
  }
  template <class Enum>
  Enum one_of(Enum last) {
    return static_cast<Enum>(in_.below(static_cast<std::size_t>(last) + 1));
  }

  /// Small and even ones from one byte, so that bodies meet; the limits and what is beyond them;
  /// any bits.
  double number() {
    static constexpr double kInfinity = std::numeric_limits<double>::infinity();
    static constexpr std::array kSpecial = {
        0.0,   1.0,        -1.0,      1e-4,
        1e-9,  1e-18,      1e3,       1e4,
        1e5,   1e6,        1e8,       1e15,
        1e18,  1e27,       -1e5,      -1e6,
        -1e8,  -1e18,      1e-30,     1e-100,
        1e100, 1e200,      5e-5,      1e16,
        1e19,  1e-160,     1e160,     5e-324,
        1e308, -kInfinity, kInfinity, std::numeric_limits<double>::quiet_NaN()};
    const auto choice = in_.any<std::uint8_t>();
    if (choice < 192 || (is_tame_ && !in_.one_in(4))) return (choice - 96) / 16.0;
    if (choice < 192 + kSpecial.size()) return kSpecial[choice - 192u];
    return in_.any<double>();
  }
  double positive() { return std::abs(number()); }
  Vec3 vector() {
    const double x = number(), y = number();
    return {x, y, number()};
  }
  Quat rotation() {
    if (in_.one_in(2)) return {};
    const double w = number(), x = number(), y = number();
    return {w, x, y, number()};
  }
  std::string name() {
    if (!in_.one_in(4)) return {};
    const ByteView bytes = in_.take(in_.below(34));
    return {bytes.begin(), bytes.end()};
  }

  Shape shape() {
    Shape s{one_of(ShapeKind::polygon), {}};
    for (std::size_t i = 0; i < size_count(s.kind); ++i) s.parameters[i] = positive();
    if (s.kind == ShapeKind::polygon) {
      const double a = positive(), b = positive();
      s = in_.one_in(2) ? Shape::polygon({0, 0}, {a, 0}, {0, b})
                        : Shape::polygon({0, 0}, {a, -b}, {a, b}, {-a, number()});
    }
    if (is_stored(s.kind)) s.parameters[0] = static_cast<double>(in_.below(4));
    if (in_.one_in(32)) s.parameters[in_.below(8)] = number();
    return s;
  }
  Material material() {
    Material m;
    m.friction = number();
    m.restitution = number();
    if (in_.one_in(2)) m.rolling_friction_m = positive();
    if (in_.one_in(2)) m.torsional_friction_m = positive();
    m.friction_rule = one_of(CombineRule::maximum);
    m.restitution_rule = one_of(CombineRule::maximum);
    return m;
  }
  BodySpec spec() {
    BodySpec s;
    s.kind = one_of(BodyKind::dynamic);
    s.shape = shape();
    s.mass_kg = positive();
    if (in_.one_in(4)) s.density_kgpm3 = positive();
    if (in_.one_in(8)) s.inertia_kgm2 = vector();
    if (in_.one_in(16)) s.inertia_products_kgm2 = vector();
    s.sets_centre_of_mass = in_.one_in(8);
    if (s.sets_centre_of_mass) s.p_BoBcm = vector();
    if (in_.one_in(4)) s.material = material();
    if (in_.one_in(8)) s.contact_tolerance_m = positive();
    s.p_WBo = vector();
    s.q_WB = rotation();
    if (in_.one_in(2)) s.v_WBcm = vector();
    if (in_.one_in(2)) s.w_WB = vector();
    s.name = name();
    return s;
  }
  Wrench wrench() {
    Wrench w;
    w.body = body_id();
    w.quantity = one_of(WrenchQuantity::acceleration);
    w.frame = one_of(WrenchFrame::body);
    w.point_kind = one_of(WrenchPoint::body_point);
    w.duration = one_of(WrenchDuration::until_cleared);
    if (w.duration == WrenchDuration::ticks) w.ticks = in_.one_in(8) ? integer() : 3;
    w.value = vector();
    if (w.point_kind != WrenchPoint::centre_of_mass) w.point = vector();
    return w;
  }
  Motion motion() {
    Motion m;
    m.body = body_id();
    m.sets_pose = in_.one_in(2);
    m.sets_velocity = in_.one_in(2);
    m.p_WBo = vector();
    m.q_WB = rotation();
    m.v_WBcm = vector();
    m.w_WB = vector();
    return m;
  }

 protected:
  Input& in_;

 private:
  bool is_tame_;
};

}  // namespace cradle::fuzz
