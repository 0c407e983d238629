#include "server/scene_forces.h"

#include <cradle/limits.h>

#include <cmath>

#include "server/collision/geometry.h"
#include "server/scene_shapes.h"

namespace cradle {
namespace {

void read_coefficient(const TomlTable& table, std::string_view key, double& value) {
  if (!table.read(key, value)) return;
  if (!std::isfinite(value)) require(table, key, Result::not_finite);
  if (value < 0 || value > limits::kWrenchMax) require(table, key, Result::out_of_range);
}

void read_point(const TomlTable& table, std::string_view key, Vec3& point) {
  if (!table.read(key, point)) return;
  const Vector p = to_eigen(point);
  if (!p.allFinite()) require(table, key, Result::not_finite);
  if (p.cwiseAbs().maxCoeff() > limits::kPositionMax_m) require(table, key, Result::out_of_range);
}

/// The place of the body that the key names.
std::optional<std::size_t> find_body(const TomlTable& table, std::string_view key,
                                     std::span<const BodySpec> bodies) {
  std::string name;
  if (!table.read(key, name)) return std::nullopt;
  for (std::size_t i = 0; i < bodies.size() && !name.empty(); ++i) {
    if (bodies[i].name == name) return i;
  }
  table.refuse(key, "no [[body]] has the name \"" + name + "\"");
}

}  // namespace

Drag read_drag(const TomlTable& body, BodyKind kind) {
  Drag drag;
  read_coefficient(body, "linear_drag_kgps", drag.linear);
  read_coefficient(body, "quadratic_drag_kgpm", drag.quadratic);
  read_coefficient(body, "angular_drag_kgm2ps", drag.angular);
  if (drag.any() && kind != BodyKind::dynamic) body.refuse("only a dynamic body has drag");
  return drag;
}

SceneSpring read_spring(const TomlTable& table, std::span<const BodySpec> bodies) {
  SceneSpring one;
  const auto a = find_body(table, "body_a", bodies);
  if (!a) table.refuse("body_a", "is missing");
  one.a = *a;
  one.b = find_body(table, "body_b", bodies);
  if (one.b == a) table.refuse("body_b", "is body_a");
  const auto is_dynamic = [&](std::size_t i) { return bodies[i].kind == BodyKind::dynamic; };
  if (!is_dynamic(one.a) && !(one.b && is_dynamic(*one.b))) table.refuse("needs a dynamic body");
  read_point(table, "point_a_m", one.spring.point_a);
  read_point(table, "point_b_m", one.spring.point_b);
  read_coefficient(table, "stiffness_npm", one.spring.stiffness);
  read_coefficient(table, "damping_nspm", one.spring.damping);
  read_coefficient(table, "rest_length_m", one.spring.rest_length);
  return one;
}

}  // namespace cradle
