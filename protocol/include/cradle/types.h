/// The vocabulary that a game and the server share: plain values, SI units, double precision.
///
/// Frames: W is the world frame, B the frame of a body, Bo its origin, Bcm its centre of mass.
/// A name says what is measured, of what, and in which frame: `v_WBcm` is the velocity of Bcm in W.
/// Rotations turn body vectors into world vectors: `r_W = q_WB * r_B`.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace cradle {

struct Vec3 {
  double x = 0, y = 0, z = 0;
  friend bool operator==(const Vec3&, const Vec3&) = default;
};

/// Of the plane x, y.
struct Vec2 {
  double x = 0, y = 0;
  friend bool operator==(const Vec2&, const Vec2&) = default;
};

/// A rotation. The server normalises what it receives; w = x = y = z = 0 is refused.
struct Quat {
  double w = 1, x = 0, y = 0, z = 0;
  friend bool operator==(const Quat&, const Quat&) = default;
};

/// Number of a body in its world: grows with creation, is never used again, fits a double.
/// Zero is no body.
struct BodyId {
  std::int64_t value = 0;
  explicit operator bool() const { return value != 0; }
  friend auto operator<=>(const BodyId&, const BodyId&) = default;
};

/// A number of steps since the start of the world. "Tick k" is the k-th step and the state after
/// it.
using Tick = std::int64_t;

enum class BodyKind : std::int32_t {
  fixed = 0,      ///< static: never moves, infinite mass
  kinematic = 1,  ///< moves by its velocities alone, infinite mass
  dynamic = 2,    ///< moves by forces and contacts
};

/// 64 bits wide, so that a Shape has no padding and its bytes can be hashed.
enum class ShapeKind : std::int64_t {
  none = 0,
  sphere = 1,
  box = 2,
  half_space = 3,
  capsule = 4,
  cylinder = 5,
  cone = 6,
  ellipsoid = 7,
  hull = 8,  ///< convex, of points; like the next three: geometry that the world holds by number
  mesh = 9,  ///< a surface of triangles
  compound = 10,      ///< posed shapes, each with its density
  height_field = 11,  ///< a grid of heights
  polygon = 12,       ///< convex, of three or four corners; for planar worlds alone
};

/// The word for it in scenes and at the command line; "unknown" for other numbers.
constexpr std::string_view word_of(ShapeKind kind) {
  constexpr std::array<std::string_view, 13> kNames = {
      "none",      "sphere", "box",  "half_space", "capsule",      "cylinder", "cone",
      "ellipsoid", "hull",   "mesh", "compound",   "height_field", "polygon"};
  const auto index = static_cast<std::uint64_t>(kind);
  return index < kNames.size() ? kNames[index] : "unknown";
}

/// How many sizes (m, each above zero) a shape of this kind has; they are its first parameters.
constexpr std::size_t size_count(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::sphere:
      return 1;
    case ShapeKind::capsule:
    case ShapeKind::cylinder:
    case ShapeKind::cone:
      return 2;
    case ShapeKind::box:
    case ShapeKind::ellipsoid:
      return 3;
    default:
      return 0;
  }
}

/// True if a shape's only parameter is the number of a geometry that its world holds, from 1 on.
constexpr bool is_stored(ShapeKind kind) {
  return kind >= ShapeKind::hull && kind <= ShapeKind::height_field;
}

/// Geometry in the body frame, immutable.
///
/// In planar worlds a sphere is a disc, a box the rectangle of its first two half extents, and a
/// capsule lies along x_B; polygons and half-spaces there are no others.
struct Shape {
  ShapeKind kind = ShapeKind::none;
  std::array<double, 8> parameters{};

  static Shape none() { return {}; }
  static Shape sphere(double radius_m) { return {ShapeKind::sphere, {radius_m}}; }
  static Shape box(const Vec3& half_extents_m) {
    return {ShapeKind::box, {half_extents_m.x, half_extents_m.y, half_extents_m.z}};
  }
  /// Solid where z_B <= 0. Only for bodies that are not dynamic.
  static Shape half_space() { return {ShapeKind::half_space, {}}; }
  /// All within the radius of the segment from -half_length_m to half_length_m on z_B.
  static Shape capsule(double radius_m, double half_length_m) {
    return {ShapeKind::capsule, {radius_m, half_length_m}};
  }
  /// Around z_B, from -half_length_m to half_length_m.
  static Shape cylinder(double radius_m, double half_length_m) {
    return {ShapeKind::cylinder, {radius_m, half_length_m}};
  }
  /// Its base, of that radius, at z_B = -half_length_m, its tip at half_length_m: Bcm is not Bo.
  static Shape cone(double radius_m, double half_length_m) {
    return {ShapeKind::cone, {radius_m, half_length_m}};
  }
  static Shape ellipsoid(const Vec3& semi_axes_m) {
    return {ShapeKind::ellipsoid, {semi_axes_m.x, semi_axes_m.y, semi_axes_m.z}};
  }
  /// Corners in the plane x, y of B, counter-clockwise, the shape convex: see polygon.h.
  static Shape polygon(const Vec2& a, const Vec2& b, const Vec2& c) { return polygon(a, b, c, c); }
  static Shape polygon(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d) {
    return {ShapeKind::polygon, {a.x, a.y, b.x, b.y, c.x, c.y, d.x, d.y}};
  }
  /// A hull, mesh, compound or height field of the world's scene, by the number that events show.
  static Shape stored(ShapeKind kind, std::int64_t number) {
    return {kind, {static_cast<double>(number)}};
  }

  double radius_m() const { return parameters[0]; }
  double half_length_m() const { return parameters[1]; }
  /// Of an ellipsoid the semi-axes.
  Vec3 half_extents_m() const { return {parameters[0], parameters[1], parameters[2]}; }
  /// Of a polygon: a triangle names its last corner twice.
  std::size_t corner_count() const {
    return parameters[4] == parameters[6] && parameters[5] == parameters[7] ? 3 : 4;
  }
  Vec2 corner_m(std::size_t k) const { return {parameters[2 * k], parameters[2 * k + 1]}; }
  friend bool operator==(const Shape&, const Shape&) = default;
};

/// How a coefficient of two bodies is made of those of each. Where they name different rules, the
/// one that comes later here counts: any that is named is stronger than none.
enum class CombineRule : std::int32_t {
  by_default = 0,  ///< none is named: the geometric mean of friction, the maximum of restitution
  average = 1,
  geometric_mean = 2,
  minimum = 3,
  multiply = 4,
  maximum = 5,
};

struct Material {
  double friction = 0.5;     ///< Coulomb coefficient
  double restitution = 0.0;  ///< 0 .. 1
  /// m: the greatest torque against rolling, by the normal force. Of two bodies the larger counts.
  double rolling_friction_m = 0.0;
  /// m: likewise against turning about the contact's normal.
  double torsional_friction_m = 0.0;
  CombineRule friction_rule = CombineRule::by_default;
  CombineRule restitution_rule = CombineRule::by_default;
  friend bool operator==(const Material&, const Material&) = default;
};

/// Everything needed to make one body.
struct BodySpec {
  BodyKind kind = BodyKind::dynamic;
  Shape shape;
  double mass_kg = 0;           ///< kg; 0: from the density
  double density_kgpm3 = 1000;  ///< kg/m^3, used if mass_kg is 0; a compound's parts have their
                                ///< own. In planar worlds bodies are 1 m deep, boxes as they say.
  /// J_xx, J_yy, J_zz of the inertia tensor about Bcm along the axes of B; 0: from the shape, and
  /// scaled with the mass.
  Vec3 inertia_kgm2;
  /// Its elements J_xy, J_xz, J_yz (J_xy is minus the integral of x y dm); only with inertia_kgm2.
  Vec3 inertia_products_kgm2;
  bool sets_centre_of_mass = false;  ///< else Bcm is that of the shape
  Vec3 p_BoBcm;                      ///< m, in B; the moments about Bcm stay what they are
  Material material;
  /// m, what its contacts may sink in by, instead of what the world allows; 0: as the world says.
  /// Worlds whose number of sub-steps is fixed refuse it: `not_allowed`.
  double contact_tolerance_m = 0;
  Vec3 p_WBo;  ///< m
  Quat q_WB;
  Vec3 v_WBcm;       ///< m/s
  Vec3 w_WB;         ///< rad/s
  std::string name;  ///< at most limits::kNameBytes, unique in the world unless empty
  friend bool operator==(const BodySpec&, const BodySpec&) = default;
};

enum class WrenchQuantity : std::int32_t {
  force = 0,            ///< N, constant over each tick
  torque = 1,           ///< N m, constant over each tick
  impulse = 2,          ///< N s, at the start of each tick
  angular_impulse = 3,  ///< N m s, at the start of each tick
  acceleration = 4,     ///< m/s^2: a force of mass times it, constant over each tick
};
enum class WrenchFrame : std::int32_t {
  world = 0,
  body = 1,  ///< the vector turns with the body, taken at each tick's start
};
enum class WrenchPoint : std::int32_t {
  centre_of_mass = 0,
  world_point = 1,  ///< stays where it is in W while the body moves
  body_point = 2,   ///< moves with the body, taken at each tick's start
};
enum class WrenchDuration : std::int32_t { this_tick = 0, ticks = 1, until_cleared = 2 };

/// One push: what, how much, in which frame, where, how long. Nothing is implied.
struct Wrench {
  BodyId body;
  WrenchQuantity quantity = WrenchQuantity::force;
  WrenchFrame frame = WrenchFrame::world;
  WrenchPoint point_kind = WrenchPoint::centre_of_mass;
  WrenchDuration duration = WrenchDuration::this_tick;
  Tick ticks = 0;  ///< how many, if duration is `ticks`; else 0
  Vec3 value;      ///< in the unit of the quantity, in `frame`
  Vec3 point;      ///< m: in W, or from Bo in B; zero for centre_of_mass
  friend bool operator==(const Wrench&, const Wrench&) = default;
};

/// A new pose, new velocities, or both, for one body.
struct Motion {
  BodyId body;
  bool sets_pose = false;
  bool sets_velocity = false;
  Vec3 p_WBo;
  Quat q_WB;
  Vec3 v_WBcm;
  Vec3 w_WB;
  friend bool operator==(const Motion&, const Motion&) = default;
};

/// Motion of one body at one tick, as published.
struct BodyState {
  BodyId body;
  BodyKind kind = BodyKind::dynamic;
  bool in_contact = false;
  bool asleep = false;       ///< at rest, and left out until something happens to it
  bool quarantined = false;  ///< taken out of the simulation: its numbers had become unusable
  Vec3 p_WBo;
  Quat q_WB;
  Vec3 v_WBcm;
  Vec3 w_WB;
  friend bool operator==(const BodyState&, const BodyState&) = default;
};

}  // namespace cradle
