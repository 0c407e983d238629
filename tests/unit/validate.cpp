// What the numbers of a command may be: every limit of limits.h just within, and just beyond.
#include "protocol/validate.h"

#include <cradle/limits.h>
#include <cradle/version.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>

namespace cradle {
namespace {

using namespace limits;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kBoundless = std::numeric_limits<double>::infinity();

double above(double x) { return std::nextafter(x, kBoundless); }
double below(double x) { return std::nextafter(x, -kBoundless); }

BodySpec valid_ball() {
  BodySpec spec;
  spec.shape = Shape::sphere(0.5);
  spec.mass_kg = 1;
  spec.inertia_kgm2 = {1, 1, 1};
  return spec;
}
BodySpec valid_brick() {
  BodySpec spec = valid_ball();
  spec.shape = Shape::box({1, 2, 3});
  return spec;
}
Wrench push() {
  Wrench wrench;
  wrench.body = {1};
  wrench.point_kind = WrenchPoint::world_point;
  return wrench;
}
Motion motion() { return {{1}, true, true, {}, {}, {}, {}}; }

template <class Value>
using Field = std::function<double&(Value&)>;

template <class Value>
Result with(Value value, const Field<Value>& field, double number) {
  field(value) = number;
  return validate(value);
}

/// The three numbers of `member`, one field each.
template <class Value>
std::vector<Field<Value>> parts(Vec3 Value::*member) {
  return {[member](Value& v) -> double& { return (v.*member).x; },
          [member](Value& v) -> double& { return (v.*member).y; },
          [member](Value& v) -> double& { return (v.*member).z; }};
}
template <class Value>
std::vector<Field<Value>> parts(Quat Value::*member) {
  return {[member](Value& v) -> double& { return (v.*member).w; },
          [member](Value& v) -> double& { return (v.*member).x; },
          [member](Value& v) -> double& { return (v.*member).y; },
          [member](Value& v) -> double& { return (v.*member).z; }};
}
template <class Value>
void append(std::vector<Field<Value>>& all, const std::vector<Field<Value>>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

/// Every number of `good` may be finite only.
template <class Value>
void check_finite(const Value& good, const std::vector<Field<Value>>& fields) {
  REQUIRE(validate(good) == Result::ok);
  for (std::size_t i = 0; i < fields.size(); ++i) {
    CAPTURE(i);
    for (const double bad : {kNaN, -kNaN, kBoundless, -kBoundless}) {
      CHECK(with(good, fields[i], bad) == Result::not_finite);
    }
  }
}

/// Each of `fields` may be -bound .. bound.
template <class Value>
void check_bound(const Value& good, const std::vector<Field<Value>>& fields, double bound) {
  for (std::size_t i = 0; i < fields.size(); ++i) {
    CAPTURE(i, bound);
    for (const double sign : {1.0, -1.0}) {
      CHECK(with(good, fields[i], sign * below(bound)) == Result::ok);
      CHECK(with(good, fields[i], sign * bound) == Result::ok);
      CHECK(with(good, fields[i], sign * above(bound)) == Result::out_of_range);
    }
  }
}

/// `field` may be lowest .. highest.
void check_range(const BodySpec& good, const Field<BodySpec>& field, double lowest,
                 double highest) {
  CAPTURE(lowest, highest);
  CHECK(with(good, field, lowest) == Result::ok);
  CHECK(with(good, field, above(lowest)) == Result::ok);
  CHECK(with(good, field, below(lowest)) == Result::out_of_range);
  CHECK(with(good, field, highest) == Result::ok);
  CHECK(with(good, field, below(highest)) == Result::ok);
  CHECK(with(good, field, above(highest)) == Result::out_of_range);
}

const Field<BodySpec> kMass = [](BodySpec& s) -> double& { return s.mass_kg; };
const Field<BodySpec> kDensity = [](BodySpec& s) -> double& { return s.density_kgpm3; };
const Field<BodySpec> kFriction = [](BodySpec& s) -> double& { return s.material.friction; };
const Field<BodySpec> kRestitution = [](BodySpec& s) -> double& { return s.material.restitution; };
const Field<BodySpec> kRolling = [](BodySpec& s) -> double& {
  return s.material.rolling_friction_m;
};
const Field<BodySpec> kTorsional = [](BodySpec& s) -> double& {
  return s.material.torsional_friction_m;
};
Field<BodySpec> parameter(std::size_t i) {
  return [i](BodySpec& s) -> double& { return s.shape.parameters[i]; };
}

}  // namespace

TEST_CASE("no number of a body may be infinite or not a number") {
  std::vector<Field<BodySpec>> fields = {kMass,        kDensity, kFriction,
                                         kRestitution, kRolling, kTorsional};
  for (std::size_t i = 0; i < 8; ++i) fields.push_back(parameter(i));
  append(fields, parts(&BodySpec::inertia_kgm2));
  append(fields, parts(&BodySpec::inertia_products_kgm2));
  append(fields, parts(&BodySpec::p_BoBcm));
  append(fields, parts(&BodySpec::p_WBo));
  append(fields, parts(&BodySpec::q_WB));
  append(fields, parts(&BodySpec::v_WBcm));
  append(fields, parts(&BodySpec::w_WB));
  REQUIRE(fields.size() == 6 + 8 + 3 + 3 + 3 + 3 + 4 + 3 + 3);  // every double of BodySpec
  check_finite(valid_brick(), fields);
  for (const BodyKind kind : {BodyKind::fixed, BodyKind::kinematic}) {
    BodySpec still = valid_brick();
    still.kind = kind;
    check_finite(still, fields);
  }
}

TEST_CASE("no number of a wrench, a motion or gravity may be infinite or not a number") {
  auto fields = parts(&Wrench::value);
  append(fields, parts(&Wrench::point));
  check_finite(push(), fields);

  auto motion_fields = parts(&Motion::p_WBo);
  append(motion_fields, parts(&Motion::q_WB));
  append(motion_fields, parts(&Motion::v_WBcm));
  append(motion_fields, parts(&Motion::w_WB));
  check_finite(motion(), motion_fields);

  for (const double bad : {kNaN, kBoundless, -kBoundless}) {
    CHECK(validate_gravity({bad, 0, 0}) == Result::not_finite);
    CHECK(validate_gravity({0, bad, 0}) == Result::not_finite);
    CHECK(validate_gravity({0, 0, bad}) == Result::not_finite);
  }
}

TEST_CASE("positions, speeds, wrenches and gravity are taken up to their limits") {
  check_bound(valid_ball(), parts(&BodySpec::p_WBo), kPositionMax_m);
  check_bound(valid_ball(), parts(&BodySpec::v_WBcm), kSpeedMax_mps);
  check_bound(valid_ball(), parts(&BodySpec::w_WB), kAngularSpeedMax_radps);
  check_bound(motion(), parts(&Motion::p_WBo), kPositionMax_m);
  check_bound(motion(), parts(&Motion::v_WBcm), kSpeedMax_mps);
  check_bound(motion(), parts(&Motion::w_WB), kAngularSpeedMax_radps);
  check_bound(push(), parts(&Wrench::value), kWrenchMax);
  check_bound(push(), parts(&Wrench::point), kPositionMax_m);
  for (const double sign : {1.0, -1.0}) {
    CHECK(validate_gravity({0, 0, sign * kGravityMax_mps2}) == Result::ok);
    CHECK(validate_gravity({0, 0, sign * above(kGravityMax_mps2)}) == Result::out_of_range);
    CHECK(validate_gravity({sign * above(kGravityMax_mps2), 0, 0}) == Result::out_of_range);
    CHECK(validate_gravity({0, sign * above(kGravityMax_mps2), 0}) == Result::out_of_range);
  }
}

TEST_CASE("sizes, masses and materials are taken within their limits") {
  check_range(valid_ball(), parameter(0), kSizeMin_m, kSizeMax_m);
  for (std::size_t i = 0; i < 3; ++i)
    check_range(valid_brick(), parameter(i), kSizeMin_m, kSizeMax_m);
  check_range(valid_ball(), kMass, kMassMin_kg, kMassMax_kg);
  check_range(valid_ball(), kFriction, 0, kFrictionMax);
  check_range(valid_ball(), kRestitution, 0, 1);
  check_range(valid_ball(), kRolling, 0, kTurningFrictionMax_m);
  check_range(valid_ball(), kTorsional, 0, kTurningFrictionMax_m);
  for (CombineRule Material::*rule : {&Material::friction_rule, &Material::restitution_rule}) {
    BodySpec spec = valid_ball();
    for (int number = -1; number <= 6; ++number) {
      spec.material.*rule = static_cast<CombineRule>(number);
      CHECK(validate(spec) == (number < 0 || number > 5 ? Result::out_of_range : Result::ok));
    }
  }
}

TEST_CASE("a shape has its own sizes, positive, and no others") {
  const auto result = [](BodyKind kind, ShapeKind shape, std::array<double, 8> parameters) {
    BodySpec spec = valid_ball();
    spec.kind = kind;
    spec.shape = {shape, parameters};
    return validate(spec);
  };
  const auto dynamic = BodyKind::dynamic;
  CHECK(result(dynamic, ShapeKind::sphere, {1}) == Result::ok);
  CHECK(result(dynamic, ShapeKind::box, {1, 1, 1}) == Result::ok);
  CHECK(result(dynamic, ShapeKind::none, {}) == Result::ok);
  CHECK(result(dynamic, ShapeKind::half_space, {}) == Result::bad_shape);
  CHECK(result(BodyKind::fixed, ShapeKind::half_space, {}) == Result::ok);
  CHECK(result(BodyKind::kinematic, ShapeKind::half_space, {}) == Result::ok);
  for (const double bad : {0.0, -0.0, -1.0, -kSizeMin_m}) {
    CHECK(result(dynamic, ShapeKind::sphere, {bad}) == Result::bad_shape);
    CHECK(result(dynamic, ShapeKind::box, {1, 1, bad}) == Result::bad_shape);
  }
  CHECK(result(dynamic, ShapeKind::none, {1}) == Result::bad_shape);
  CHECK(result(dynamic, ShapeKind::sphere, {1, 1}) == Result::bad_shape);
  CHECK(result(dynamic, ShapeKind::box, {1, 1, 1, 0, 0, 0, 0, 1}) == Result::bad_shape);
  CHECK(result(BodyKind::fixed, ShapeKind::half_space, {1}) == Result::bad_shape);
  for (const ShapeKind two : {ShapeKind::capsule, ShapeKind::cylinder, ShapeKind::cone}) {
    CHECK(result(dynamic, two, {1, 2}) == Result::ok);
    CHECK(result(dynamic, two, {1}) == Result::bad_shape);
    CHECK(result(dynamic, two, {1, 2, 3}) == Result::bad_shape);
    CHECK(result(dynamic, two, {1, kSizeMax_m * 1.01}) == Result::out_of_range);
  }
  CHECK(result(dynamic, ShapeKind::ellipsoid, {1, 2, 3}) == Result::ok);
  CHECK(result(dynamic, ShapeKind::ellipsoid, {1, 2, 0}) == Result::bad_shape);
  for (const ShapeKind stored :
       {ShapeKind::hull, ShapeKind::mesh, ShapeKind::compound, ShapeKind::height_field}) {
    // Whether there is one, the world knows; but ground is for no dynamic body.
    const Result as_body = stored == ShapeKind::height_field ? Result::bad_shape : Result::ok;
    CHECK(result(dynamic, stored, {1}) == as_body);
    CHECK(result(dynamic, stored, {kGeometries}) == as_body);
    for (const double bad : {0.0, -1.0, 1.5, kGeometries + 1.0, 1e300}) {
      CHECK(result(dynamic, stored, {bad}) == Result::bad_shape);
    }
    CHECK(result(dynamic, stored, {1, 1}) == Result::bad_shape);
    CHECK(result(dynamic, stored, {std::nan("")}) == Result::not_finite);
  }
  const ShapeKind polygon = ShapeKind::polygon;
  CHECK(result(dynamic, polygon, {0, 0, 2, 0, 2, 1, 0, 1}) == Result::ok);
  CHECK(result(dynamic, polygon, {0, 0, 2, 0, 2, 1, 2, 1}) == Result::ok);         // a triangle
  CHECK(result(dynamic, polygon, {0, 0, 0, 1, 2, 1, 2, 0}) == Result::bad_shape);  // clockwise
  CHECK(result(dynamic, polygon, {0, 0, 2, 0, 0.1, 0.1, 0, 1}) == Result::bad_shape);
  CHECK(result(dynamic, polygon, {0, 0, 2, 0, 2, 0, 0, 1}) == Result::bad_shape);
  CHECK(result(dynamic, polygon, {}) == Result::bad_shape);
  CHECK(result(dynamic, polygon, {0, 0, 2, 0, 1e7, 1}) == Result::out_of_range);
  CHECK(result(dynamic, polygon, {0, 0, 2, 0, std::nan(""), 1}) == Result::not_finite);
  for (const int unknown : {-1, 13}) {
    CHECK(result(dynamic, static_cast<ShapeKind>(unknown), {}) == Result::bad_shape);
  }
}

TEST_CASE("a dynamic body needs a mass, or a shape and a density") {
  BodySpec spec = valid_ball();
  spec.inertia_kgm2 = {};
  const auto result = [&spec](double mass_kg, double density_kgpm3) {
    spec.mass_kg = mass_kg;
    spec.density_kgpm3 = density_kgpm3;
    return validate(spec);
  };
  CHECK(result(1, 0) == Result::ok);
  CHECK(result(0, 1) == Result::ok);
  CHECK(result(0, 0) == Result::bad_mass);
  CHECK(result(-1, 1) == Result::bad_mass);
  CHECK(result(1, -1) == Result::bad_mass);
  spec.shape = Shape::none();
  CHECK(result(1, 0) == Result::ok);
  CHECK(result(0, 1) == Result::bad_mass);
  spec.kind = BodyKind::fixed;  // infinite, whatever is said
  CHECK(result(0, 0) == Result::ok);
}

TEST_CASE("moments of inertia are those that some rigid body has") {
  const auto result = [](double x, double y, double z) {
    BodySpec spec = valid_ball();
    spec.inertia_kgm2 = {x, y, z};
    return validate(spec);
  };
  CHECK(result(0, 0, 0) == Result::ok);  // from the shape
  CHECK(result(1, 2, 3) == Result::ok);  // a flat body: the largest is the sum of the others
  CHECK(result(3, 1, 2) == Result::ok);
  CHECK(result(2, 3, 1) == Result::ok);
  CHECK(result(0.1, 0.7, 0.8) == Result::ok);  // flat too: 0.1 + 0.7 is below 0.8 when rounded
  const double beyond = 3 + 1e-8;              // above the slack for rounding of 1e-9
  CHECK(result(1, 2, beyond) == Result::bad_mass);
  CHECK(result(beyond, 1, 2) == Result::bad_mass);
  CHECK(result(2, beyond, 1) == Result::bad_mass);
  for (const double bad : {0.0, -1.0}) {
    CHECK(result(bad, 1, 1) == Result::bad_mass);
    CHECK(result(1, bad, 1) == Result::bad_mass);
    CHECK(result(1, 1, bad) == Result::bad_mass);
  }
  const auto equal = [&](double moment) { return result(moment, moment, moment); };
  CHECK(equal(kInertiaMin_kgm2) == Result::ok);
  CHECK(equal(below(kInertiaMin_kgm2)) == Result::out_of_range);
  CHECK(equal(kInertiaMax_kgm2) == Result::ok);
  CHECK(equal(above(kInertiaMax_kgm2)) == Result::out_of_range);
}

TEST_CASE("a tensor with products is one whose principal moments some rigid body has") {
  // J = R diag(1, 1 + x, 2) R^T for turns about slanted axes: physical for x >= 0, since flat at 0.
  const auto result = [](double x, int turn) {
    const double a = 0.4 * turn, n[3] = {1.0 / 3, -2.0 / 3, 2.0 / 3};
    const double moments[3] = {1, 1 + x, 2}, c = std::cos(a), s = std::sin(a);
    double R[3][3], J[3][3] = {};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {  // Rodrigues' formula
        const int k = 3 - i - j;
        const double across = i == j ? 0 : ((j - i + 3) % 3 == 1 ? -n[k] : n[k]);
        R[i][j] = (i == j ? c : 0) + s * across + (1 - c) * n[i] * n[j];
      }
    }
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        for (int k = 0; k < 3; ++k) J[i][j] += R[i][k] * moments[k] * R[j][k];
      }
    }
    BodySpec spec = valid_ball();
    spec.inertia_kgm2 = {J[0][0], J[1][1], J[2][2]};
    spec.inertia_products_kgm2 = {J[0][1], J[0][2], J[1][2]};
    return validate(spec);
  };
  for (int turn = 0; turn < 16; ++turn) {
    CAPTURE(turn);
    CHECK(result(0.5, turn) == Result::ok);
    CHECK(result(0, turn) == Result::ok);  // flat, up to rounding
    CHECK(result(-1e-7, turn) == Result::bad_mass);
    CHECK(result(-0.5, turn) == Result::bad_mass);
  }
  BodySpec spec = valid_ball();
  spec.inertia_kgm2 = {1, 1, 1};
  for (double Vec3::*product : {&Vec3::x, &Vec3::y, &Vec3::z}) {
    spec.inertia_products_kgm2 = {};
    spec.inertia_products_kgm2.*product = 0.49;  // moments 0.51, 1, 1.49
    CHECK(validate(spec) == Result::ok);
    spec.inertia_products_kgm2.*product = -0.51;
    CHECK(validate(spec) == Result::bad_mass);
  }
  spec.inertia_kgm2 = {};  // products alone
  CHECK(validate(spec) == Result::bad_mass);
}

TEST_CASE("a centre of mass counts only where it is said to") {
  BodySpec spec = valid_ball();
  spec.sets_centre_of_mass = true;
  check_bound(spec, parts(&BodySpec::p_BoBcm), kSizeMax_m);
  spec.sets_centre_of_mass = false;
  spec.p_BoBcm = {0, 0, 1};
  CHECK(validate(spec) == Result::bad_mass);
}

TEST_CASE("a rotation needs a length that can be normalised, not length one") {
  const auto result = [](const Quat& q) {
    BodySpec spec = valid_ball();
    spec.q_WB = q;
    Motion m = motion();
    m.q_WB = q;
    CHECK(validate(spec) == validate(m));
    return validate(spec);
  };
  CHECK(result({3, -4, 0, 12}) == Result::ok);
  CHECK(result({1e-90, 0, 0, 0}) == Result::ok);
  CHECK(result({0, 0, 1e90, 0}) == Result::ok);
  CHECK(result({0, 0, 0, 0}) == Result::bad_rotation);
  CHECK(result({1e-200, 0, 0, 0}) == Result::bad_rotation);  // its square vanishes
  CHECK(result({0, 1e200, 0, 0}) == Result::bad_rotation);   // its square overflows
}

TEST_CASE(
    "every combination of quantity, frame, point and duration is taken or refused as stated") {
  // wrench_spec_v1.lcm: torques and angular impulses act at the centre of mass; a point there is
  // zero; `ticks` counts for TICKS and is zero else. Everything else can be combined.
  int taken = 0;
  for (const int quantity : {0, 1, 2, 3, 4}) {
    for (const int frame : {0, 1}) {
      for (const int point : {0, 1, 2}) {
        for (const int duration : {0, 1, 2}) {
          CAPTURE(quantity, frame, point, duration);
          Wrench w;
          w.body = {1};
          w.quantity = static_cast<WrenchQuantity>(quantity);
          w.frame = static_cast<WrenchFrame>(frame);
          w.point_kind = static_cast<WrenchPoint>(point);
          w.duration = static_cast<WrenchDuration>(duration);
          w.ticks = duration == 1 ? 1 : 0;
          w.value = {1, 2, 3};
          w.point = point == 0 ? Vec3{} : Vec3{0, 0, 1};
          const bool is_moment = quantity == 1 || quantity == 3;
          const bool is_stated = !is_moment || point == 0;
          CHECK(validate(w) == (is_stated ? Result::ok : Result::bad_wrench));
          taken += is_stated;

          w.ticks = duration == 1 ? 0 : 1;
          CHECK(validate(w) == Result::bad_wrench);
          w.ticks = -1;
          CHECK(validate(w) == Result::bad_wrench);
          w.ticks = kIntegerMax;
          CHECK((validate(w) == Result::ok) == (is_stated && duration == 1));
          w.ticks = duration == 1 ? 1 : 0;
          w.point = {0, 0, 1};
          CHECK((validate(w) == Result::ok) == (is_stated && point != 0));
        }
      }
    }
  }
  CHECK(taken == (3 * 3 + 2 * 1) * 2 * 3);
}

TEST_CASE("a wrench and a motion name a body, and a motion says what it sets") {
  for (const std::int64_t id : {std::int64_t{0}, std::int64_t{-1}}) {
    Wrench w = push();
    w.body = {id};
    CHECK(validate(w) == Result::unknown_body);
    Motion m = motion();
    m.body = {id};
    CHECK(validate(m) == Result::unknown_body);
  }
  Motion nothing = motion();
  nothing.sets_pose = nothing.sets_velocity = false;
  CHECK(validate(nothing) == Result::malformed);
}

TEST_CASE("a motion's numbers count only if they are set") {
  Motion m = motion();
  m.p_WBo.x = kNaN;
  CHECK(validate(m) == Result::not_finite);
  m.sets_pose = false;
  CHECK(validate(m) == Result::ok);
  m.w_WB.z = kBoundless;
  CHECK(validate(m) == Result::not_finite);
}

TEST_CASE("names are UTF-8 without control characters, of 31 bytes at most") {
  const auto is_good = [](std::string_view name) { return is_name(name, kNameBytes); };
  CHECK(is_good(""));
  CHECK(is_good("crate 7~"));
  CHECK(is_good(std::string(kNameBytes, 'n')));
  CHECK(!is_good(std::string(kNameBytes + 1, 'n')));
  // The ends of the ranges of well-formed UTF-8 (Unicode 15, table 3-7).
  for (const char* good :
       {"\xC2\xA0", "\xDF\xBF", "\xE0\xA0\x80", "\xEC\xBF\xBF", "\xED\x9F\xBF", "\xEE\x80\x80",
        "\xEF\xBF\xBF", "\xF0\x90\x80\x80", "\xF3\xBF\xBF\xBF", "\xF4\x8F\xBF\xBF"}) {
    CAPTURE(good);
    CHECK(is_good(good));
    CHECK(is_good(std::string(kNameBytes - std::string(good).size(), 'x') + good));
  }
  for (const char* bad :
       {"\x80", "\xBF", "\xC0\x80", "\xC1\xBF", "\xC3", "\xC3x", "\xC3\xC3", "\xE0\x9F\xBF",
        "\xE2\x82", "\xE2\x82x", "\xED\xA0\x80", "\xED\xBF\xBF", "\xF0\x8F\xBF\xBF", "\xF0\x9F\x98",
        "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xFF"}) {
    CAPTURE(bad);
    CHECK(!is_good(bad));
    CHECK(!is_good(std::string("a") + bad + "b"));
  }
  // Control characters would steer the terminal of whoever reads the log: C0, delete, and C1.
  for (int c = 0; c < 0x20; ++c) CHECK(!is_good(std::string(1, static_cast<char>(c))));
  CHECK(!is_good("\x7F"));
  CHECK(!is_good("\xC2\x80"));
  CHECK(!is_good("\xC2\x9B"));
  CHECK(!is_good("\xC2\x9F"));
}

TEST_CASE("a command's first fault is reported with its item") {
  BodySpec bad = valid_ball();
  bad.material.friction = -1;
  const CommandBody spawn = Spawn{{valid_ball(), valid_ball(), bad, bad}};
  CHECK(validate(spawn) == Outcome{Result::out_of_range, {}, 2});
  CHECK(validate(CommandBody(Despawn{{{1}, {0}}})) == Outcome{Result::unknown_body, {}, 1});
  for (const CommandBody& empty :
       std::vector<CommandBody>{Spawn{}, Despawn{}, Push{}, ClearWrenches{}, SetMotion{}}) {
    CHECK(validate(empty).result == Result::malformed);
  }
}

TEST_CASE("hello, steps and gravity are checked as whole commands") {
  const auto result = [](const CommandBody& body) { return validate(body).result; };
  CHECK(result(Hello{kProtocolVersion, "me"}) == Result::ok);
  CHECK(result(Hello{kProtocolVersion + 1, "me"}) == Result::bad_version);
  CHECK(result(Hello{kProtocolVersion, "\n"}) == Result::bad_name);
  CHECK(result(SetGravity{{0, 0, 2 * kGravityMax_mps2}}) == Result::out_of_range);
  CHECK(result(Control{ControlAction::step, 1}) == Result::ok);
  CHECK(result(Control{ControlAction::step, kStepsPerCommand}) == Result::ok);
  CHECK(result(Control{ControlAction::step, 0}) == Result::out_of_range);
  CHECK(result(Control{ControlAction::step, -1}) == Result::out_of_range);
  CHECK(result(Control{ControlAction::step, kStepsPerCommand + 1}) == Result::out_of_range);
  for (const auto action : {ControlAction::pause, ControlAction::resume, ControlAction::shutdown}) {
    CHECK(result(Control{action, 0}) == Result::ok);
    CHECK(result(Control{action, 1}) == Result::malformed);
  }
}

}  // namespace cradle
