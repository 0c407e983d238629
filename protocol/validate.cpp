#include "protocol/validate.h"

#include <cradle/limits.h>
#include <cradle/polygon.h>
#include <cradle/version.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>

namespace cradle {
namespace {

using namespace limits;

bool is_finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
bool is_finite(const Quat& q) {
  return std::isfinite(q.w) && std::isfinite(q.x) && std::isfinite(q.y) && std::isfinite(q.z);
}
bool is_within(const Vec3& v, double bound) {
  return std::abs(v.x) <= bound && std::abs(v.y) <= bound && std::abs(v.z) <= bound;
}
bool is_zero(const Vec3& v) { return v == Vec3{}; }

/// The first that is not ok.
Result first_fault(std::initializer_list<Result> results) {
  const auto fault =
      std::find_if(results.begin(), results.end(), [](Result r) { return r != Result::ok; });
  return fault == results.end() ? Result::ok : *fault;
}

Result check(const Vec3& v, double bound) {
  if (!is_finite(v)) return Result::not_finite;
  return is_within(v, bound) ? Result::ok : Result::out_of_range;
}

Result check_rotation(const Quat& q) {
  if (!is_finite(q)) return Result::not_finite;
  const double squared_norm = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
  // The squares must neither vanish nor overflow, or normalising would lose the direction.
  return squared_norm > 1e-200 && squared_norm < 1e200 ? Result::ok : Result::bad_rotation;
}

/// The first of these is the number of a geometry; whether the world holds it, the world knows.
Result check_number(const std::array<double, 8>& parameters) {
  const double number = parameters[0];
  const bool is_alone = std::all_of(parameters.begin() + 1, parameters.end(),
                                    [](double other) { return other == 0; });
  const bool is_number = number >= 1 && number <= kGeometries && number == std::floor(number);
  return is_alone && is_number ? Result::ok : Result::bad_shape;
}

Result check_polygon(const Shape& shape) {
  std::array<Vec2, 4> corners;
  for (std::size_t k = 0; k < 4; ++k) corners[k] = shape.corner_m(k);
  for (const double p : shape.parameters) {
    if (std::abs(p) > kSizeMax_m) return Result::out_of_range;
  }
  const auto used = std::span(corners).first(shape.corner_count());
  return polygon_fault(used).empty() ? Result::ok : Result::bad_shape;
}

Result check_shape(const BodySpec& spec) {
  for (double p : spec.shape.parameters) {
    if (!std::isfinite(p)) return Result::not_finite;
  }
  const ShapeKind kind = spec.shape.kind;
  if (word_of(kind) == "unknown") return Result::bad_shape;
  const bool is_ground = kind == ShapeKind::half_space || kind == ShapeKind::height_field;
  if (is_ground && spec.kind == BodyKind::dynamic) return Result::bad_shape;
  const auto& p = spec.shape.parameters;
  if (is_stored(kind)) return check_number(p);
  if (kind == ShapeKind::polygon) return check_polygon(spec.shape);
  const std::size_t sizes = size_count(kind);
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (i >= sizes && p[i] != 0) return Result::bad_shape;
    if (i < sizes && !(p[i] > 0)) return Result::bad_shape;
    if (i < sizes && !(p[i] >= kSizeMin_m && p[i] <= kSizeMax_m)) return Result::out_of_range;
  }
  return Result::ok;
}

/// The relative error up to which moments may break the triangle inequality: flat bodies stand at
/// its very edge, and numbers written with ten digits are off by that much.
constexpr double kMomentSlack = 1e-9;

/// True if some distribution of mass has the tensor with diagonal `J` and products `P` (xy, xz,
/// yz).
///
/// The integrals of x_i x_j dm are S = tr(J)/2 - J, which must not be negative in any direction. In
/// principal axes that is the triangle inequality: no moment is larger than the sum of the others.
/// Checked by the pivots of S, raised by half the slack.
bool is_inertia(const Vec3& J, const Vec3& P) {
  const double half_slack = 0.5 * kMomentSlack * std::max({J.x, J.y, J.z});
  const double xx = 0.5 * (J.y + J.z - J.x) + half_slack;
  const double yy = 0.5 * (J.z + J.x - J.y) + half_slack;
  const double zz = 0.5 * (J.x + J.y - J.z) + half_slack;
  if (!(xx >= 0 && yy >= 0 && zz >= 0)) return false;
  if (is_zero(P)) return true;
  const double first = xx;
  const double second = yy - P.x * P.x / first;
  const double coupling = -P.z - P.x * P.y / first;
  const double third = zz - P.y * P.y / first - coupling * coupling / second;
  return first > 0 && second > 0 && third > 0;
}

/// A mass and moments that a rigid body can have, before the shape adds its share.
Result check_mass(const BodySpec& spec) {
  const Vec3& J = spec.inertia_kgm2;
  const Vec3& products = spec.inertia_products_kgm2;
  if (!std::isfinite(spec.mass_kg) || !std::isfinite(spec.density_kgpm3) || !is_finite(J) ||
      !is_finite(products)) {
    return Result::not_finite;
  }
  if (spec.kind != BodyKind::dynamic) return Result::ok;
  if (spec.mass_kg < 0 || spec.density_kgpm3 < 0) return Result::bad_mass;
  const bool has_shape = spec.shape.kind != ShapeKind::none;
  if (spec.mass_kg == 0 && (!has_shape || spec.density_kgpm3 == 0)) return Result::bad_mass;
  if (spec.mass_kg > 0 && !(spec.mass_kg >= kMassMin_kg && spec.mass_kg <= kMassMax_kg)) {
    return Result::out_of_range;
  }
  if (is_zero(J)) {  // from the shape, or a point that does not turn
    return is_zero(products) ? Result::ok : Result::bad_mass;
  }
  if (!(J.x > 0 && J.y > 0 && J.z > 0)) return Result::bad_mass;
  if (!(std::min({J.x, J.y, J.z}) >= kInertiaMin_kgm2 && is_within(J, kInertiaMax_kgm2))) {
    return Result::out_of_range;
  }
  return is_inertia(J, products) ? Result::ok : Result::bad_mass;
}

Result check_centre(const BodySpec& spec) {
  const Result result = check(spec.p_BoBcm, kSizeMax_m);
  if (result != Result::ok || spec.sets_centre_of_mass) return result;
  return is_zero(spec.p_BoBcm) ? Result::ok : Result::bad_mass;
}

bool is_rule(CombineRule rule) {
  return rule >= CombineRule::by_default && rule <= CombineRule::maximum;
}

Result check_material(const Material& m) {
  const std::pair<double, double> upto[] = {{m.friction, kFrictionMax},
                                            {m.restitution, 1},
                                            {m.rolling_friction_m, kTurningFrictionMax_m},
                                            {m.torsional_friction_m, kTurningFrictionMax_m}};
  bool is_in_range = is_rule(m.friction_rule) && is_rule(m.restitution_rule);
  for (const auto& [value, most] : upto) {
    if (!std::isfinite(value)) return Result::not_finite;
    is_in_range = is_in_range && value >= 0 && value <= most;
  }
  return is_in_range ? Result::ok : Result::out_of_range;
}

/// 0: none of its own.
Result check_tolerance(double tolerance_m) {
  if (!std::isfinite(tolerance_m)) return Result::not_finite;
  const bool is_in_range = tolerance_m == 0 || (tolerance_m >= kContactToleranceMin_m &&
                                                tolerance_m <= kContactToleranceMax_m);
  return is_in_range ? Result::ok : Result::out_of_range;
}

/// Length of the UTF-8 sequence that `lead` begins, 0 if it begins none (Unicode 15, table 3-7).
int sequence_length(unsigned char lead) {
  if (lead < 0x80) return 1;
  if (lead >= 0xC2 && lead <= 0xDF) return 2;
  if (lead >= 0xE0 && lead <= 0xEF) return 3;
  if (lead >= 0xF0 && lead <= 0xF4) return 4;
  return 0;
}

/// True if `second` may follow `lead`: the same table, without the control characters of C2 80..9F.
bool may_follow(unsigned char lead, unsigned char second) {
  switch (lead) {
    case 0xC2:
    case 0xE0:
      return second >= 0xA0;
    case 0xED:
      return second <= 0x9F;
    case 0xF0:
      return second >= 0x90;
    case 0xF4:
      return second <= 0x8F;
    default:
      return true;
  }
}

Result validate(BodyId id) { return id.value > 0 ? Result::ok : Result::unknown_body; }

template <class Items>
Outcome validate_items(const Items& items) {
  if (items.empty()) return {Result::malformed, {}, 0};
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Result result = validate(items[i]);
    if (result != Result::ok) return {result, {}, static_cast<std::int32_t>(i)};
  }
  return {};
}

struct Validator {
  Outcome operator()(const Hello& c) const {
    if (c.protocol_version != kProtocolVersion) return {Result::bad_version, {}, 0};
    return {is_name(c.name, kNameBytes) ? Result::ok : Result::bad_name, {}, 0};
  }
  Outcome operator()(const Spawn& c) const { return validate_items(c.bodies); }
  Outcome operator()(const Despawn& c) const { return validate_items(c.bodies); }
  Outcome operator()(const Push& c) const { return validate_items(c.wrenches); }
  Outcome operator()(const ClearWrenches& c) const { return validate_items(c.bodies); }
  Outcome operator()(const SetMotion& c) const { return validate_items(c.motions); }
  Outcome operator()(const SetGravity& c) const { return {validate_gravity(c.gravity_W), {}, 0}; }
  Outcome operator()(const Control& c) const {
    if (c.action != ControlAction::step)
      return {c.steps == 0 ? Result::ok : Result::malformed, {}, 0};
    const bool is_in_range = c.steps >= 1 && c.steps <= kStepsPerCommand;
    return {is_in_range ? Result::ok : Result::out_of_range, {}, 0};
  }
};

}  // namespace

bool is_name(std::string_view name, int max_bytes) {
  if (name.size() > static_cast<std::size_t>(max_bytes)) return false;
  for (std::size_t i = 0; i < name.size();) {
    const auto lead = static_cast<unsigned char>(name[i]);
    const int length = sequence_length(lead);
    if (length == 0 || lead < 0x20 || lead == 0x7F) return false;
    if (i + static_cast<std::size_t>(length) > name.size()) return false;
    for (int k = 1; k < length; ++k) {
      const auto byte = static_cast<unsigned char>(name[i + static_cast<std::size_t>(k)]);
      if ((byte & 0xC0) != 0x80 || (k == 1 && !may_follow(lead, byte))) return false;
    }
    i += static_cast<std::size_t>(length);
  }
  return true;
}

Result validate(const BodySpec& spec) {
  return first_fault({check_shape(spec), check_mass(spec), check_centre(spec),
                      check_material(spec.material), check_tolerance(spec.contact_tolerance_m),
                      check(spec.p_WBo, kPositionMax_m), check_rotation(spec.q_WB),
                      check(spec.v_WBcm, kSpeedMax_mps), check(spec.w_WB, kAngularSpeedMax_radps),
                      is_name(spec.name, kNameBytes) ? Result::ok : Result::bad_name});
}

Result validate(const Wrench& w) {
  if (w.body.value <= 0) return Result::unknown_body;
  const Result numbers = first_fault({check(w.value, kWrenchMax), check(w.point, kPositionMax_m)});
  if (numbers != Result::ok) return numbers;
  const bool is_pure_moment =
      w.quantity == WrenchQuantity::torque || w.quantity == WrenchQuantity::angular_impulse;
  const bool is_central = w.point_kind == WrenchPoint::centre_of_mass;
  if (is_pure_moment && !is_central) return Result::bad_wrench;
  if (is_central && !is_zero(w.point)) return Result::bad_wrench;
  const bool is_counted = w.duration == WrenchDuration::ticks;
  return is_counted == (w.ticks >= 1) && w.ticks >= 0 ? Result::ok : Result::bad_wrench;
}

Result validate(const Motion& m) {
  if (m.body.value <= 0) return Result::unknown_body;
  if (!m.sets_pose && !m.sets_velocity) return Result::malformed;
  Result result = Result::ok;
  if (m.sets_pose) result = first_fault({check(m.p_WBo, kPositionMax_m), check_rotation(m.q_WB)});
  if (result == Result::ok && m.sets_velocity) {
    result = first_fault({check(m.v_WBcm, kSpeedMax_mps), check(m.w_WB, kAngularSpeedMax_radps)});
  }
  return result;
}

Result validate_gravity(const Vec3& gravity_W) { return check(gravity_W, kGravityMax_mps2); }

Outcome validate(const CommandBody& body) { return std::visit(Validator{}, body); }

}  // namespace cradle
