#include "server/scene_shapes.h"

#include <cradle/limits.h>

#include <filesystem>

#include "protocol/validate.h"
#include "server/collision/planar_pairs.h"
#include "server/dynamics/rotation.h"
#include "server/mesh_file.h"
#include "server/world/plane.h"

namespace cradle {
namespace {

// tests/scenes/README.md documents them, and a test compares.
constexpr std::string_view kPartKeys[] = {
    "shape", "radius_m",      "half_length_m", "half_extents_m",   "points_m",    "triangles",
    "file",  "density_kgpm3", "position_m",    "orientation_wxyz", "rotation_rad"};

constexpr std::pair<std::string_view, ShapeKind> kBodyShapes[] = {
    {"none", ShapeKind::none},         {"sphere", ShapeKind::sphere},
    {"box", ShapeKind::box},           {"half_space", ShapeKind::half_space},
    {"capsule", ShapeKind::capsule},   {"cylinder", ShapeKind::cylinder},
    {"cone", ShapeKind::cone},         {"ellipsoid", ShapeKind::ellipsoid},
    {"hull", ShapeKind::hull},         {"mesh", ShapeKind::mesh},
    {"compound", ShapeKind::compound}, {"height_field", ShapeKind::height_field},
    {"polygon", ShapeKind::polygon},
};
constexpr std::pair<std::string_view, ShapeKind> kPartShapes[] = {
    {"sphere", ShapeKind::sphere},   {"box", ShapeKind::box},
    {"capsule", ShapeKind::capsule}, {"cylinder", ShapeKind::cylinder},
    {"cone", ShapeKind::cone},       {"ellipsoid", ShapeKind::ellipsoid},
    {"hull", ShapeKind::hull},       {"mesh", ShapeKind::mesh},
    {"polygon", ShapeKind::polygon},
};

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

/// A key that one kind of shape has to have and others cannot have.
void check_presence(const TomlTable& table, std::string_view key, bool is_there, bool is_wanted) {
  if (is_there == is_wanted) return;
  if (is_wanted) table.refuse("shape", "needs " + std::string(key));
  table.refuse(key, "this shape has none");
}

/// Alone in its body, so that it can be judged.
Result validate_alone(const Shape& shape) {
  BodySpec body;
  body.kind = BodyKind::fixed;
  body.shape = shape;
  return validate(body);
}

std::vector<Vector> vectors(const std::vector<std::array<double, 3>>& points) {
  std::vector<Vector> all;
  for (const auto& p : points) all.emplace_back(p[0], p[1], p[2]);
  return all;
}

std::string sentence(ShapeKind kind, const std::string& fault) {
  return kind == ShapeKind::hull ? fault : "the mesh " + fault;
}

MadeGeometry make(ShapeKind kind, const MeshFile& surface) {
  return kind == ShapeKind::hull ? make_hull(surface.vertices)
                                 : make_mesh(surface.vertices, surface.triangles);
}

}  // namespace

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
      return "sizes must be positive, and a half_space or height_field must not be dynamic";
    case Result::bad_mass:
      return "a dynamic body needs a mass above 0";
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

void read_orientation(const TomlTable& table, Quat& q) {
  if (table.read("orientation_wxyz", q)) {
    if (table.has("rotation_rad")) table.refuse("rotation_rad", "orientation_wxyz is given, too");
    BodySpec body;
    body.kind = BodyKind::fixed;
    body.q_WB = q;
    require(table, "orientation_wxyz", validate(body));
  }
  Vec3 r;
  if (!table.read("rotation_rad", r)) return;
  if (!(r.x * r.x + r.y * r.y + r.z * r.z <= kTurnMax_rad * kTurnMax_rad)) {
    table.refuse("rotation_rad", "must be one turn at most (6.3 rad)");
  }
  q = rotation_of(r);
}

ShapeReader::ShapeReader(const std::string& scene) : scene_(scene) {}

Result ShapeReader::mass_of(const BodySpec& spec, MassProperties& mass) const {
  const MassDistribution* stored = nullptr;
  if (is_stored(spec.shape.kind)) {
    stored = &masses_[static_cast<std::size_t>(spec.shape.parameters[0]) - 1];
  }
  return is_planar_ ? planar_mass_properties(spec, stored, mass)
                    : mass_properties(spec, stored, mass);
}

void ShapeReader::read(const TomlTable& table, BodySpec& spec) {
  ShapeKind kind = ShapeKind::none;
  table.read("shape", kind, kBodyShapes);
  spec.shape = read_simple(table, kind);
  const std::vector<TomlTable> parts = table.tables("part", kPartKeys);
  check_presence(table, "part", !parts.empty(), kind == ShapeKind::compound);
  GeometryPointer geometry = read_surface(table, spec.shape);
  if (kind == ShapeKind::compound) geometry = read_compound(table, parts);
  if (GeometryPointer field = read_field(table, kind)) geometry = std::move(field);
  const std::string_view fault = is_planar_ ? shape_out_of_plane(spec.shape, geometry.get())
                                            : shape_out_of_space(spec.shape, geometry.get());
  if (!fault.empty()) table.refuse(std::string(fault));
  if (!geometry) return require(table, "shape", validate(spec));  // a dynamic half-space

  if (geometries_.size() >= static_cast<std::size_t>(limits::kGeometries)) {
    table.refuse("shape", "too many hulls, meshes, compounds and height fields");
  }
  const auto* mesh = std::get_if<TriangleMesh>(&geometry->value);
  if (mesh && !mesh->is_closed && spec.kind == BodyKind::dynamic) {
    table.refuse("shape",
                 "a dynamic body needs a closed mesh, and this one is open: " + open_edge(*mesh));
  }
  if (kind == ShapeKind::height_field && spec.kind == BodyKind::dynamic) {
    table.refuse("shape", "a height_field must not be dynamic");
  }
  geometries_.push_back(geometry);
  masses_.push_back(geometry_mass(*geometry, is_planar_));
  spec.shape = Shape::stored(geometry->kind(), static_cast<std::int64_t>(geometries_.size()));
}

/// The shapes that are a kind and sizes; of the others the kind alone.
Shape ShapeReader::read_simple(const TomlTable& table, ShapeKind kind) const {
  using enum ShapeKind;
  const bool is_long = kind == capsule || kind == cylinder || kind == cone;
  const bool is_wide = kind == box || kind == ellipsoid;
  double radius_m = 0, half_length_m = 0;
  Vec3 half_extents_m;
  check_presence(table, "radius_m", table.read("radius_m", radius_m), kind == sphere || is_long);
  check_presence(table, "half_length_m", table.read("half_length_m", half_length_m), is_long);
  check_presence(table, "half_extents_m", table.read("half_extents_m", half_extents_m), is_wide);

  Shape shape{kind, {}};
  if (is_wide) shape.parameters = {half_extents_m.x, half_extents_m.y, half_extents_m.z};
  if (kind == sphere) shape.parameters = {radius_m};
  if (is_long) shape.parameters = {radius_m, half_length_m};
  if (is_long) require(table, "radius_m", validate_alone(Shape::sphere(radius_m)));
  if (size_count(kind) == 0) return shape;
  const char* key = is_wide ? "half_extents_m" : is_long ? "half_length_m" : "radius_m";
  require(table, key, validate_alone(shape));
  return shape;
}

/// A polygon that fits the shape becomes it; one of more corners is returned.
GeometryPointer ShapeReader::read_polygon(const TomlTable& table, Shape& shape) const {
  std::vector<std::array<double, 3>> points;
  for (const char* key : {"file", "triangles"}) check_presence(table, key, table.has(key), false);
  check_presence(table, "points_m", table.read("points_m", points), true);
  std::vector<Vec2> corners;
  for (const auto& p : points) {
    if (p[2] != 0) table.refuse("points_m", "the corners of a polygon must have z = 0");
    corners.push_back({p[0], p[1]});
  }
  MadeGeometry made = make_polygon(corners);
  if (!made.geometry) table.refuse("points_m", "the polygon " + made.fault);
  if (corners.size() > 4) {
    shape = {ShapeKind::hull, {}};
    return made.geometry;
  }
  shape = Shape::polygon(corners[0], corners[1], corners[2], corners.back());
  return nullptr;
}

/// A hull or a mesh, from the file or from the keys; null for other kinds.
GeometryPointer ShapeReader::read_surface(const TomlTable& table, Shape& shape) {
  const ShapeKind kind = shape.kind;
  if (kind == ShapeKind::polygon) return read_polygon(table, shape);
  const bool is_hull = kind == ShapeKind::hull, is_mesh = kind == ShapeKind::mesh;
  std::string file;
  std::vector<std::array<double, 3>> points;
  std::vector<std::array<std::int64_t, 3>> triangles;
  const bool has_file = table.read("file", file);
  const bool has_points = table.read("points_m", points);
  const bool has_triangles = table.read("triangles", triangles);
  const bool is_field = kind == ShapeKind::height_field;
  if (has_file) check_presence(table, "file", true, is_hull || is_mesh || is_field);
  check_presence(table, "points_m", has_points, (is_hull || is_mesh) && !has_file);
  check_presence(table, "triangles", has_triangles, is_mesh && !has_file);
  if (has_file && !is_field) return read_file(table, kind, file);
  if (!has_points) return nullptr;

  MeshFile surface{vectors(points), {}};
  for (const auto& t : triangles) {
    Triangle corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      if (t[k] < 0 || t[k] >= static_cast<std::int64_t>(points.size())) {
        table.refuse("triangles", "there is no point " + std::to_string(t[k]) + " (from 0) of " +
                                      std::to_string(points.size()));
      }
      corners[k] = static_cast<std::int32_t>(t[k]);
    }
    surface.triangles.push_back(corners);
  }
  const MadeGeometry made = make(kind, surface);
  if (!made.geometry) table.refuse(is_hull ? "points_m" : "triangles", sentence(kind, made.fault));
  return made.geometry;
}

GeometryPointer ShapeReader::read_file(const TomlTable& table, ShapeKind kind,
                                       const std::string& file) {
  GeometryPointer& known = files_[{kind, file}];
  if (known) return known;
  const auto path = std::filesystem::path(scene_).parent_path() / file;
  if (path.extension() != ".obj") table.refuse("file", "\"" + file + "\" is no .obj file");
  MeshFile surface;
  try {
    surface = parse_obj(cradle::read_file(path.string()), file);
  } catch (const MeshFileError& error) {
    table.refuse("file", error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    table.refuse("file", path.string() + ": " + error.code().message());
  }
  MadeGeometry made = make(kind, surface);
  if (!made.geometry) table.refuse("file", sentence(kind, made.fault));
  return known = made.geometry;
}

/// Null for other kinds.
GeometryPointer ShapeReader::read_field(const TomlTable& table, ShapeKind kind) {
  const bool is_field = kind == ShapeKind::height_field;
  std::string file;
  std::vector<std::vector<double>> rows;
  std::array<double, 2> spacing{};
  const bool has_heights = table.read("heights_m", rows), has_file = table.read("file", file);
  if (has_heights) check_presence(table, "heights_m", true, is_field);
  check_presence(table, "spacing_m", table.read("spacing_m", spacing), is_field);
  if (!is_field) return nullptr;
  if (has_heights && has_file) table.refuse("heights_m", "file is given, too");
  if (!has_heights && !has_file) table.refuse("shape", "needs heights_m or file");
  const char* key = has_file ? "file" : "heights_m";
  if (has_file) {
    const auto path = std::filesystem::path(scene_).parent_path() / file;
    try {
      rows = parse_heights(cradle::read_file(path.string()), file);
    } catch (const MeshFileError& error) {
      table.refuse("file", error.what());
    } catch (const std::filesystem::filesystem_error& error) {
      table.refuse("file", path.string() + ": " + error.code().message());
    }
  }
  std::vector<double> heights;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (rows[k].size() != rows.front().size()) {
      table.refuse(key, "row " + std::to_string(k) + " has " + std::to_string(rows[k].size()) +
                            " heights, and row 0 has " + std::to_string(rows.front().size()));
    }
    heights.insert(heights.end(), rows[k].begin(), rows[k].end());
  }
  const auto columns = rows.empty() ? std::size_t{0} : rows.front().size();
  const MadeGeometry made =
      make_height_field(static_cast<std::int32_t>(rows.size()), static_cast<std::int32_t>(columns),
                        spacing[0], spacing[1], std::move(heights));
  if (!made.geometry) table.refuse(key, "the height field " + made.fault);
  return made.geometry;
}

GeometryPointer ShapeReader::read_compound(const TomlTable& table,
                                           const std::vector<TomlTable>& tables) {
  std::vector<CompoundPart> parts;
  for (const TomlTable& part : tables) parts.push_back(read_part(part));
  MadeGeometry made = make_compound(std::move(parts));
  if (!made.geometry) table.refuse("part", "the compound " + made.fault);
  return made.geometry;
}

CompoundPart ShapeReader::read_part(const TomlTable& table) {
  CompoundPart part;
  ShapeKind kind = ShapeKind::none;
  if (!table.read("shape", kind, kPartShapes)) table.refuse("shape", "is missing");
  part.shape = read_simple(table, kind);
  part.geometry = read_surface(table, part.shape);
  const auto* mesh = part.geometry ? std::get_if<TriangleMesh>(&part.geometry->value) : nullptr;
  if (mesh && !mesh->is_closed) {
    table.refuse("shape", "a part needs a closed mesh, and this one is open: " + open_edge(*mesh));
  }
  table.read("density_kgpm3", part.density_kgpm3);
  if (!std::isfinite(part.density_kgpm3)) require(table, "density_kgpm3", Result::not_finite);
  if (!(part.density_kgpm3 > 0)) table.refuse("density_kgpm3", "must be above 0");
  BodySpec pose;
  pose.kind = BodyKind::fixed;
  table.read("position_m", pose.p_WBo);
  require(table, "position_m", validate(pose));
  read_orientation(table, pose.q_WB);
  part.p_BoPo = to_eigen(pose.p_WBo);
  part.q_BP = normalised(to_eigen(pose.q_WB));
  return part;
}

}  // namespace cradle
