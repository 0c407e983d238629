#include "server/scene.h"

#include <cradle/limits.h>

#include <algorithm>
#include <set>

#include "protocol/validate.h"
#include "server/collision/broad_phase.h"
#include "server/dynamics/mass_properties.h"
#include "server/scene_forces.h"
#include "server/scene_lattice.h"
#include "server/scene_shapes.h"
#include "server/world/plane.h"
#include "server/world/world.h"

namespace cradle {
namespace {

// All keys there are; tests/scenes/README.md documents them, and a test compares.
constexpr std::string_view kSceneKeys[] = {"world", "body", "spring", "lattice"};
constexpr std::string_view kWorldKeys[] = {"rate_hz",       "sub_steps",      "contact_tolerance_m",
                                           "planar",        "gravity_mps2",   "solver",
                                           "scheme",        "broad_phase",    "sleeping",
                                           "balance_every", "balance_flight", "collides_twice"};
constexpr std::string_view kBodyKeys[] = {"name",
                                          "kind",
                                          "shape",
                                          "radius_m",
                                          "half_length_m",
                                          "half_extents_m",
                                          "points_m",
                                          "triangles",
                                          "file",
                                          "heights_m",
                                          "spacing_m",
                                          "part",
                                          "mass_kg",
                                          "density_kgpm3",
                                          "inertia_kgm2",
                                          "inertia_products_kgm2",
                                          "centre_of_mass_m",
                                          "friction",
                                          "restitution",
                                          "rolling_friction_m",
                                          "torsional_friction_m",
                                          "friction_rule",
                                          "restitution_rule",
                                          "contact_tolerance_m",
                                          "position_m",
                                          "orientation_wxyz",
                                          "rotation_rad",
                                          "velocity_mps",
                                          "angular_velocity_radps",
                                          "linear_drag_kgps",
                                          "quadratic_drag_kgpm",
                                          "angular_drag_kgm2ps",
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
constexpr std::pair<std::string_view, CombineRule> kRules[] = {
    {"average", CombineRule::average},
    {"geometric_mean", CombineRule::geometric_mean},
    {"minimum", CombineRule::minimum},
    {"multiply", CombineRule::multiply},
    {"maximum", CombineRule::maximum}};
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

void read_name(const TomlTable& table, std::string_view key, const std::vector<std::string>& names,
               std::string& name) {
  table.read(key, name);
  if (std::find(names.begin(), names.end(), name) != names.end()) return;
  std::string known;
  for (const std::string& one : names) known += (known.empty() ? "" : ", ") + one;
  table.refuse(key, "\"" + name + "\" is none of " + known);
}

/// Refuses the table, or its key, unless there is no fault.
void refuse(const TomlTable& table, std::string_view fault) {
  if (!fault.empty()) table.refuse(std::string(fault));
}
void refuse(const TomlTable& table, std::string_view key, std::string_view fault) {
  if (!fault.empty()) table.refuse(key, std::string(fault));
}

WorldSettings read_settings(const TomlTable& table) {
  WorldSettings settings;
  table.read("rate_hz", settings.rate_hz);
  if (!(settings.rate_hz >= limits::kRateMin_hz && settings.rate_hz <= limits::kRateMax_hz)) {
    require(table, "rate_hz", Result::out_of_range);
  }
  const bool has_sub_steps = table.read("sub_steps", settings.sub_steps);
  if (has_sub_steps && (settings.sub_steps < 1 || settings.sub_steps > limits::kSubStepsMax)) {
    require(table, "sub_steps", Result::out_of_range);
  }
  const bool has_tolerance = table.read("contact_tolerance_m", settings.contact_tolerance_m);
  if (!(settings.contact_tolerance_m >= limits::kContactToleranceMin_m &&
        settings.contact_tolerance_m <= limits::kContactToleranceMax_m)) {
    require(table, "contact_tolerance_m", Result::out_of_range);
  }
  if (has_sub_steps && has_tolerance) {
    table.refuse("contact_tolerance_m", "sub_steps are given, too");
  }
  table.read("sleeping", settings.is_sleeping);
  table.read("collides_twice", settings.collides_twice);
  table.read("balance_every", settings.balance_every);
  if (settings.balance_every < 0) require(table, "balance_every", Result::out_of_range);
  table.read("balance_flight", settings.balance_flight);
  table.read("planar", settings.is_planar);
  if (settings.is_planar) settings.gravity_W = {0, -9.81, 0};
  table.read("gravity_mps2", settings.gravity_W);
  require(table, "gravity_mps2", validate_gravity(settings.gravity_W));
  if (settings.is_planar) refuse(table, "gravity_mps2", out_of_plane_gravity(settings.gravity_W));
  read_name(table, "solver", solver_names(), settings.solver);
  read_name(table, "scheme", scheme_names(), settings.scheme);
  read_name(table, "broad_phase", broad_phase_names(), settings.broad_phase);
  return settings;
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
  explicit SceneReader(const TomlFile& file) : root_(file, kSceneKeys), shapes_(file.name) {
    scene_.name = file.name;
  }

  Scene read() {
    if (const auto world = root_.table("world", kWorldKeys)) {
      scene_.settings = read_settings(*world);
    }
    shapes_.set_planar(scene_.settings.is_planar);
    for (const TomlTable& entry : root_.tables("body", kBodyKeys)) {
      const TomlTable table = entry.about(description(entry));
      const BodySpec body = read_body(table);
      const Wrenches wrenches = read_wrenches(table);
      if (is_planar()) require_in_plane(table, "", body, wrenches);
      add(table, body, read_drag(table, body.kind), wrenches);
    }
    for (const TomlTable& table : root_.tables("spring", kSpringKeys)) {
      scene_.springs.push_back(read_spring(table, scene_.bodies));
      if (is_planar()) refuse(table, out_of_plane(scene_.springs.back().spring));
    }
    for (const TomlTable& table : root_.tables("lattice", kLatticeKeys)) add_lattice(table);
    scene_.geometries = shapes_.take_geometries();
    std::stable_sort(scene_.wrenches.begin(), scene_.wrenches.end(),
                     [](const auto& a, const auto& b) { return a.tick < b.tick; });
    return std::move(scene_);
  }

 private:
  using Wrenches = std::vector<TimedWrench>;

  /// What refusals call the body of a table: its name, or else its id.
  std::string description(const TomlTable& body) const {
    std::string name;
    body.read("name", name);
    if (name.empty()) return "body " + std::to_string(scene_.bodies.size() + 1);
    return "body \"" + name + "\"";
  }

  bool is_planar() const { return scene_.settings.is_planar; }

  /// `prefix` says which body of the table it is.
  void require_in_plane(const TomlTable& table, const std::string& prefix, const BodySpec& body,
                        const Wrenches& wrenches) const {
    MassProperties mass;
    const Result result = shapes_.mass_of(body, mass);
    if (result != Result::ok) return;  // told by its key
    std::string_view fault = out_of_plane(body, mass);
    for (const TimedWrench& timed : wrenches) {
      if (fault.empty()) fault = out_of_plane(timed.wrench);
    }
    if (!fault.empty()) table.refuse(prefix + std::string(fault));
  }

  BodySpec read_body(const TomlTable& table) {
    BodySpec spec;
    spec.mass_kg = 1;  // until the mass is read: so each key can be judged as soon as it is there
    const auto read = [&](std::string_view key, auto& target) {
      if (table.read(key, target)) require(table, key, validate(spec));
    };
    read("name", spec.name);
    table.read("kind", spec.kind, kBodyKinds);
    shapes_.read(table, spec);
    read("friction", spec.material.friction);
    read("restitution", spec.material.restitution);
    read("rolling_friction_m", spec.material.rolling_friction_m);
    read("torsional_friction_m", spec.material.torsional_friction_m);
    table.read("friction_rule", spec.material.friction_rule, kRules);
    table.read("restitution_rule", spec.material.restitution_rule, kRules);
    read("contact_tolerance_m", spec.contact_tolerance_m);
    if (spec.contact_tolerance_m > 0 && scene_.settings.sub_steps > 0) {
      table.refuse("contact_tolerance_m", "the world's sub_steps are given, too");
    }
    read("position_m", spec.p_WBo);
    read_orientation(table, spec.q_WB);
    read("velocity_mps", spec.v_WBcm);
    read("angular_velocity_radps", spec.w_WB);
    read_mass(table, spec);
    return spec;
  }

  void read_mass(const TomlTable& table, BodySpec& spec) const {
    spec.mass_kg = 0;
    const bool has_mass = table.read("mass_kg", spec.mass_kg);
    const bool has_density = table.read("density_kgpm3", spec.density_kgpm3);
    if (has_mass && has_density) table.refuse("density_kgpm3", "mass_kg is given, too");
    if (has_density && spec.shape.kind == ShapeKind::compound) {
      table.refuse("density_kgpm3", "the parts of a compound have densities of their own");
    }
    if (has_mass && spec.mass_kg <= 0) table.refuse("mass_kg", "must be above 0");
    if (has_density && spec.density_kgpm3 <= 0) table.refuse("density_kgpm3", "must be above 0");
    const auto judge = [&](std::string_view key) {
      require(table, key, validate(spec));
      MassProperties derived;
      require(table, key, shapes_.mass_of(spec, derived));
    };
    judge(has_density ? "density_kgpm3" : "mass_kg");
    if (table.read("centre_of_mass_m", spec.p_BoBcm)) {
      spec.sets_centre_of_mass = true;
      judge("centre_of_mass_m");
    }
    read_inertia(table, spec);
    if (spec.inertia_kgm2 != Vec3{}) judge("inertia_kgm2");
  }

  static void read_inertia(const TomlTable& table, BodySpec& spec) {
    table.read("inertia_kgm2", spec.inertia_kgm2);
    const bool has_products = table.read("inertia_products_kgm2", spec.inertia_products_kgm2);
    if (has_products && spec.inertia_kgm2 == Vec3{} && spec.inertia_products_kgm2 != Vec3{}) {
      table.refuse("inertia_products_kgm2", "needs inertia_kgm2");
    }
    if (validate(spec) != Result::bad_mass) return;
    table.refuse(has_products ? "inertia_products_kgm2" : "inertia_kgm2",
                 "no rigid body has these moments: the principal ones must be above 0, and none "
                 "larger than the sum of the others");
  }

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

  void add(const TomlTable& table, BodySpec body, const Drag& drag, const Wrenches& wrenches) {
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
    scene_.drags.push_back(drag);
  }

  void add_lattice(const TomlTable& table) {
    const Lattice lattice = read_lattice(table);
    std::vector<Wrenches> wrenches;
    std::vector<Drag> drags;
    for (const TomlTable& body : table.tables("body", kBodyKeys)) {
      wrenches.push_back(read_wrenches(body));
      drags.push_back(read_drag(body, lattice.bodies[drags.size()].kind));
    }
    std::size_t turn = 0;
    for (BodySpec& body : bodies_of(lattice)) {
      const Result result = validate(body);
      const std::string number = "its body number " + std::to_string(turn) + ": ";
      if (result != Result::ok) table.refuse(number + reason(result));
      if (is_planar()) require_in_plane(table, number, body, wrenches[turn % wrenches.size()]);
      const std::size_t which = turn++ % wrenches.size();
      add(table, std::move(body), drags[which], wrenches[which]);
    }
  }

  Lattice read_lattice(const TomlTable& table) {
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
  ShapeReader shapes_;
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
