#include "server/scene.h"

#include <cradle/limits.h>

#include <algorithm>
#include <set>

#include "protocol/validate.h"
#include "server/dynamics/mass_properties.h"
#include "server/scene_lattice.h"
#include "server/toml_reader.h"
#include "server/world/world.h"

namespace cradle {
namespace {

// All keys there are; tests/scenes/README.md documents them, and a test compares.
constexpr std::string_view kSceneKeys[] = {"world", "body", "lattice"};
constexpr std::string_view kWorldKeys[] = {"rate_hz", "sub_steps", "gravity_mps2", "solver"};
constexpr std::string_view kBodyKeys[] = {
    "name",          "kind",           "shape",
    "radius_m",      "half_extents_m", "mass_kg",
    "density_kgpm3", "inertia_kgm2",   "friction",
    "restitution",   "position_m",     "orientation_wxyz",
    "rotation_rad",  "velocity_mps",   "angular_velocity_radps",
    "wrench"};
constexpr std::string_view kWrenchKeys[] = {"tick",    "quantity", "frame",    "point",
                                            "point_m", "value",    "duration", "ticks"};
constexpr std::string_view kLatticeKeys[] = {"count",
                                             "pitch_m",
                                             "origin_m",
                                             "taper",
                                             "jitter_m",
                                             "random_orientation",
                                             "velocity_jitter_mps",
                                             "angular_velocity_jitter_radps",
                                             "seed",
                                             "body"};

constexpr std::pair<std::string_view, BodyKind> kBodyKinds[] = {{"static", BodyKind::fixed},
                                                                {"kinematic", BodyKind::kinematic},
                                                                {"dynamic", BodyKind::dynamic}};
constexpr std::pair<std::string_view, ShapeKind> kShapeKinds[] = {
    {"none", ShapeKind::none},
    {"sphere", ShapeKind::sphere},
    {"box", ShapeKind::box},
    {"half_space", ShapeKind::half_space}};
constexpr std::pair<std::string_view, WrenchQuantity> kQuantities[] = {
    {"force", WrenchQuantity::force},
    {"torque", WrenchQuantity::torque},
    {"impulse", WrenchQuantity::impulse},
    {"angular_impulse", WrenchQuantity::angular_impulse},
    {"acceleration", WrenchQuantity::acceleration}};
constexpr std::pair<std::string_view, WrenchFrame> kFrames[] = {{"world", WrenchFrame::world},
                                                                {"body", WrenchFrame::body}};
constexpr std::pair<std::string_view, WrenchPoint> kPoints[] = {
    {"centre_of_mass", WrenchPoint::centre_of_mass},
    {"world_point", WrenchPoint::world_point},
    {"body_point", WrenchPoint::body_point}};
constexpr std::pair<std::string_view, WrenchDuration> kDurations[] = {
    {"this_tick", WrenchDuration::this_tick},
    {"ticks", WrenchDuration::ticks},
    {"until_cleared", WrenchDuration::until_cleared}};

std::string reason(Result result) {
  switch (result) {
    case Result::not_finite:
      return "must be finite";
    case Result::out_of_range:
      return "out of range, see cradled serve --print-limits";
    case Result::bad_name:
      return "must be UTF-8 without control characters, at most " +
             std::to_string(limits::kNameBytes) + " bytes long";
    case Result::bad_shape:
      return "sizes must be positive, and a half_space must not be dynamic";
    case Result::bad_mass:
      return "a dynamic body needs a positive mass, and moments that a rigid body can have";
    case Result::bad_rotation:
      return "a quaternion without length is no rotation";
    case Result::bad_wrench:
      return "contradicts the keys before it";
    default:
      return std::string(to_string(result));
  }
}

void require(const TomlTable& table, std::string_view key, Result result) {
  if (result != Result::ok) table.refuse(key, reason(result));
}

/// exp of half the rotation vector, by its series: no libm, whose bits depend on the processor.
/// For turns up to kTurnMax_rad rounding stays below cosh(pi) 2^-53, the cut-off far below that.
constexpr double kTurnMax_rad = 6.3;
Quat rotation_of(const Vec3& rotation_rad) {
  const double squared_half =
      0.25 * (rotation_rad.x * rotation_rad.x + rotation_rad.y * rotation_rad.y +
              rotation_rad.z * rotation_rad.z);
  double cosine = 1, sinc = 1;
  for (int n = 30; n >= 2; n -= 2) {
    cosine = 1 - squared_half / (n * (n - 1)) * cosine;
    sinc = 1 - squared_half / (n * (n + 1)) * sinc;
  }
  const double s = 0.5 * sinc;
  return {cosine, s * rotation_rad.x, s * rotation_rad.y, s * rotation_rad.z};
}

WorldSettings read_settings(const TomlTable& table) {
  WorldSettings settings;
  table.read("rate_hz", settings.rate_hz);
  if (!(settings.rate_hz >= limits::kRateMin_hz && settings.rate_hz <= limits::kRateMax_hz)) {
    require(table, "rate_hz", Result::out_of_range);
  }
  table.read("sub_steps", settings.sub_steps);
  if (settings.sub_steps < 1 || settings.sub_steps > limits::kSubStepsMax) {
    require(table, "sub_steps", Result::out_of_range);
  }
  table.read("gravity_mps2", settings.gravity_W);
  require(table, "gravity_mps2", validate_gravity(settings.gravity_W));
  table.read("solver", settings.solver);
  const std::vector<std::string> solvers = solver_names();
  if (std::find(solvers.begin(), solvers.end(), settings.solver) == solvers.end()) {
    std::string known;
    for (const std::string& name : solvers) known += (known.empty() ? "" : ", ") + name;
    table.refuse("solver", "\"" + settings.solver + "\" is none of " + known);
  }
  return settings;
}

/// A size that one kind of shape has to have and others cannot have.
template <class Size>
void read_size(const TomlTable& table, std::string_view key, bool is_wanted, Size& size) {
  if (table.read(key, size) == is_wanted) return;
  if (is_wanted) table.refuse("shape", "needs " + std::string(key));
  table.refuse(key, "this shape has none");
}

void read_shape(const TomlTable& table, BodySpec& spec) {
  ShapeKind kind = ShapeKind::none;
  double radius_m = 0;
  Vec3 half_extents_m;
  table.read("shape", kind, kShapeKinds);
  read_size(table, "radius_m", kind == ShapeKind::sphere, radius_m);
  read_size(table, "half_extents_m", kind == ShapeKind::box, half_extents_m);
  if (kind == ShapeKind::sphere) {
    spec.shape = Shape::sphere(radius_m);
    require(table, "radius_m", validate(spec));
  } else if (kind == ShapeKind::box) {
    spec.shape = Shape::box(half_extents_m);
    require(table, "half_extents_m", validate(spec));
  } else if (kind == ShapeKind::half_space) {
    spec.shape = Shape::half_space();
    require(table, "shape", validate(spec));
  }
}

void read_orientation(const TomlTable& table, BodySpec& spec) {
  if (table.read("orientation_wxyz", spec.q_WB)) {
    if (table.has("rotation_rad")) table.refuse("rotation_rad", "orientation_wxyz is given, too");
    require(table, "orientation_wxyz", validate(spec));
  }
  Vec3 r;
  if (!table.read("rotation_rad", r)) return;
  if (!(r.x * r.x + r.y * r.y + r.z * r.z <= kTurnMax_rad * kTurnMax_rad)) {
    table.refuse("rotation_rad", "must be one turn at most (6.3 rad)");
  }
  spec.q_WB = rotation_of(r);
}

void read_mass(const TomlTable& table, BodySpec& spec) {
  spec.mass_kg = 0;
  const bool has_mass = table.read("mass_kg", spec.mass_kg);
  const bool has_density = table.read("density_kgpm3", spec.density_kgpm3);
  if (has_mass && has_density) table.refuse("density_kgpm3", "mass_kg is given, too");
  if (has_mass && spec.mass_kg == 0) require(table, "mass_kg", Result::bad_mass);
  const std::string_view key = has_density ? "density_kgpm3" : "mass_kg";
  require(table, key, validate(spec));
  MassProperties derived;
  require(table, key, mass_properties(spec, derived));
  if (!table.read("inertia_kgm2", spec.inertia_kgm2)) return;
  require(table, "inertia_kgm2", validate(spec));
  require(table, "inertia_kgm2", mass_properties(spec, derived));
}

BodySpec read_body(const TomlTable& table) {
  BodySpec spec;
  spec.mass_kg = 1;  // until the mass is read: so each key can be judged as soon as it is there
  const auto read = [&](std::string_view key, auto& target) {
    if (table.read(key, target)) require(table, key, validate(spec));
  };
  read("name", spec.name);
  table.read("kind", spec.kind, kBodyKinds);
  read_shape(table, spec);
  read("friction", spec.material.friction);
  read("restitution", spec.material.restitution);
  read("position_m", spec.p_WBo);
  read_orientation(table, spec);
  read("velocity_mps", spec.v_WBcm);
  read("angular_velocity_radps", spec.w_WB);
  read_mass(table, spec);
  return spec;
}

TimedWrench read_wrench(const TomlTable& table) {
  TimedWrench timed;
  Wrench& wrench = timed.wrench;
  wrench.body.value = 1;  // any: so each key can be judged as soon as it is there
  const auto judge = [&](std::string_view key, bool is_given) {
    if (is_given) require(table, key, validate(wrench));
  };
  table.read("tick", timed.tick);
  if (timed.tick < 1 || timed.tick > limits::kIntegerMax) {
    require(table, "tick", Result::out_of_range);
  }
  table.read("quantity", wrench.quantity, kQuantities);
  table.read("frame", wrench.frame, kFrames);
  judge("point", table.read("point", wrench.point_kind, kPoints));
  judge("point_m", table.read("point_m", wrench.point));
  if (!table.read("value", wrench.value)) table.refuse("value", "is missing");
  judge("value", true);
  table.read("duration", wrench.duration, kDurations);
  const bool has_ticks = table.read("ticks", wrench.ticks);
  if (wrench.ticks > limits::kIntegerMax) require(table, "ticks", Result::out_of_range);
  judge(has_ticks ? "ticks" : "duration", true);
  wrench.body = {};
  return timed;
}

class SceneReader {
 public:
  explicit SceneReader(const TomlFile& file) : root_(file, kSceneKeys) { scene_.name = file.name; }

  Scene read() {
    if (const auto world = root_.table("world", kWorldKeys)) {
      scene_.settings = read_settings(*world);
    }
    for (const TomlTable& table : root_.tables("body", kBodyKeys)) {
      add(table, read_body(table), read_wrenches(table));
    }
    for (const TomlTable& table : root_.tables("lattice", kLatticeKeys)) add_lattice(table);
    std::stable_sort(scene_.wrenches.begin(), scene_.wrenches.end(),
                     [](const auto& a, const auto& b) { return a.tick < b.tick; });
    return std::move(scene_);
  }

 private:
  using Wrenches = std::vector<TimedWrench>;

  static Wrenches read_wrenches(const TomlTable& body) {
    Wrenches wrenches;
    BodyKind kind = BodyKind::dynamic;
    body.read("kind", kind, kBodyKinds);
    for (const TomlTable& table : body.tables("wrench", kWrenchKeys)) {
      if (kind != BodyKind::dynamic) table.refuse("only a dynamic body can be pushed");
      wrenches.push_back(read_wrench(table));
    }
    return wrenches;
  }

  void add(const TomlTable& table, BodySpec body, const Wrenches& wrenches) {
    if (scene_.bodies.size() >= static_cast<std::size_t>(scene_.settings.bodies_max)) {
      table.refuse("too many bodies");
    }
    if (!body.name.empty() && !names_.insert(body.name).second) {
      table.refuse("name", "\"" + body.name + "\" is the name of another body already");
    }
    for (TimedWrench timed : wrenches) {
      timed.body = scene_.bodies.size();
      scene_.wrenches.push_back(timed);
    }
    scene_.bodies.push_back(std::move(body));
  }

  void add_lattice(const TomlTable& table) {
    const Lattice lattice = read_lattice(table);
    std::vector<Wrenches> wrenches;
    for (const TomlTable& body : table.tables("body", kBodyKeys)) {
      wrenches.push_back(read_wrenches(body));
    }
    std::size_t turn = 0;
    for (BodySpec& body : bodies_of(lattice)) {
      const Result result = validate(body);
      if (result != Result::ok) {
        table.refuse("its body number " + std::to_string(turn) + ": " + reason(result));
      }
      add(table, std::move(body), wrenches[turn++ % wrenches.size()]);
    }
  }

  Lattice read_lattice(const TomlTable& table) const {
    Lattice lattice;
    if (!table.read("count", lattice.count)) table.refuse("count", "is missing");
    std::int64_t room = scene_.settings.bodies_max;
    for (std::int64_t n : lattice.count) {
      if (n < 1) require(table, "count", Result::out_of_range);
      room /= n;
    }
    if (room < 1) table.refuse("count", "too many bodies");
    if (!table.read("pitch_m", lattice.pitch_m)) table.refuse("pitch_m", "is missing");
    table.read("origin_m", lattice.origin_m);
    table.read("taper", lattice.taper);
    for (std::size_t axis : {0U, 1U}) {
      const std::int64_t taper = lattice.taper[axis], layers_above = lattice.count[2] - 1;
      // Below count first, so that the product cannot overflow.
      if (taper < 0 || taper >= lattice.count[axis] ||
          taper * layers_above >= lattice.count[axis]) {
        table.refuse("taper", "must leave a body in the highest layer");
      }
    }
    table.read("jitter_m", lattice.jitter_m);
    table.read("random_orientation", lattice.random_orientation);
    table.read("velocity_jitter_mps", lattice.velocity_jitter_mps);
    table.read("angular_velocity_jitter_radps", lattice.angular_velocity_jitter_radps);
    table.read("seed", lattice.seed);
    if (lattice.seed < 0) require(table, "seed", Result::out_of_range);
    for (const TomlTable& body : table.tables("body", kBodyKeys)) {
      if (body.has("name")) body.refuse("name", "bodies of a lattice have none");
      lattice.bodies.push_back(read_body(body));
    }
    if (lattice.bodies.empty()) table.refuse("needs a [[lattice.body]]");
    return lattice;
  }

  TomlTable root_;
  Scene scene_;
  std::set<std::string> names_;
};

}  // namespace

Scene load_scene(const std::string& path) { return parse_scene(read_file(path), path); }

Scene parse_scene(std::string_view text, const std::string& name) {
  const TomlFile file(text, name, refuse_with<SceneError>);
  return SceneReader(file).read();
}

}  // namespace cradle
