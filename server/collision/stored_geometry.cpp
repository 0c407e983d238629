#include "server/collision/stored_geometry.h"

#include <cradle/limits.h>
#include <cradle/polygon.h>

#include <cmath>

#include "server/collision/bounds.h"
#include "server/collision/box_tree.h"
#include "server/collision/planar_pairs.h"

namespace cradle {

ShapeKind StoredGeometry::kind() const {
  static_assert(static_cast<int>(ShapeKind::mesh) == static_cast<int>(ShapeKind::hull) + 1);
  static_assert(static_cast<int>(ShapeKind::compound) == static_cast<int>(ShapeKind::hull) + 2);
  static_assert(static_cast<int>(ShapeKind::height_field) == static_cast<int>(ShapeKind::hull) + 3);
  if (std::holds_alternative<ConvexPolygon>(value)) return ShapeKind::hull;
  return static_cast<ShapeKind>(static_cast<std::size_t>(ShapeKind::hull) + value.index());
}

namespace {

std::string fault_of(const CompoundPart& part) {
  const ShapeKind kind = part.shape.kind;
  if (kind == ShapeKind::compound) return "is a compound itself";
  if (kind == ShapeKind::height_field) return "is no solid";
  if (is_stored(kind)) {
    if (!part.geometry || part.geometry->kind() != kind) return "has no geometry";
    const auto* mesh = std::get_if<TriangleMesh>(&part.geometry->value);
    if (mesh && !mesh->is_closed) return "is open: " + open_edge(*mesh);
  } else if (size_count(kind) == 0 && kind != ShapeKind::polygon) {
    return "is no solid";
  }
  if (!(part.density_kgpm3 > 0 && std::isfinite(part.density_kgpm3))) {
    return "has no density above 0";
  }
  return {};
}

/// A part's box in the frame of its compound, in space and in planar worlds.
Aabb box_of(const CompoundPart& part, const Pose& X_BP) {
  const Collider collider{part.shape, X_BP, part.geometry.get()};
  const Aabb solid = bounds(collider), flat = bounds_in_plane(collider);
  return {solid.lower.cwiseMin(flat.lower), solid.upper.cwiseMax(flat.upper)};
}

/// Fills in what follows from the parts.
void complete_compound(Compound& compound) {
  std::vector<FloatBox> boxes;
  std::vector<std::int32_t> with_box;
  for (const CompoundPart& part : compound.parts) {
    const Pose& X_BP = compound.X_BP.emplace_back(Pose{part.p_BoPo, part.q_BP.toRotationMatrix()});
    const Aabb box = box_of(part, X_BP);
    boxes.push_back(to_float(box, Vector::Zero()));
    if (box.is_empty()) continue;
    with_box.push_back(static_cast<std::int32_t>(boxes.size()) - 1);
    compound.box = {compound.box.lower.cwiseMin(box.lower), compound.box.upper.cwiseMax(box.upper)};
  }
  BoxTree tree;
  tree.build(boxes, with_box, MortonCurve(boxes, with_box));
  compound.tree = std::make_shared<const BoxTree>(std::move(tree));
}

}  // namespace

MadeGeometry make_height_field(std::int32_t rows, std::int32_t columns, double spacing_x_m,
                               double spacing_y_m, std::vector<double> heights) {
  if (rows < 2 || columns < 2) return {nullptr, "has fewer than two rows or columns"};
  const std::int64_t count = std::int64_t{rows} * columns;
  if (count > limits::kPoints) return {nullptr, "has too many heights"};
  if (static_cast<std::int64_t>(heights.size()) != count) {
    return {nullptr, "has " + std::to_string(heights.size()) + " heights for " +
                         std::to_string(rows) + " rows of " + std::to_string(columns)};
  }
  HeightField field{rows, columns, spacing_x_m, spacing_y_m, std::move(heights)};
  for (const double spacing : {spacing_x_m, spacing_y_m}) {
    if (!(spacing >= limits::kSizeMin_m)) return {nullptr, "has cells that are too small"};
  }
  if (!(std::fmax(field.x(columns - 1), field.y(rows - 1)) <= limits::kSizeMax_m)) {
    return {nullptr, "is too large"};
  }
  field.lowest = field.highest = field.heights.front();
  for (std::size_t i = 0; i < field.heights.size(); ++i) {
    const double z = field.heights[i];
    if (!(std::abs(z) <= limits::kSizeMax_m)) {
      const auto width = static_cast<std::size_t>(columns);
      return {nullptr, "has in row " + std::to_string(i / width) + ", column " +
                           std::to_string(i % width) +
                           ", a height that is out of range or no number"};
    }
    field.lowest = std::fmin(field.lowest, z);
    field.highest = std::fmax(field.highest, z);
  }
  return {std::make_shared<const StoredGeometry>(StoredGeometry{std::move(field)}), {}};
}

MadeGeometry make_compound(std::vector<CompoundPart> parts) {
  if (parts.empty()) return {nullptr, "has no parts"};
  if (parts.size() > static_cast<std::size_t>(limits::kParts))
    return {nullptr, "has too many parts"};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::string fault = fault_of(parts[i]);
    if (!fault.empty()) return {nullptr, "its part " + std::to_string(i) + " " + fault};
  }
  Compound compound;
  compound.parts = std::move(parts);
  complete_compound(compound);
  return {std::make_shared<const StoredGeometry>(StoredGeometry{std::move(compound)}), {}};
}

MadeGeometry make_polygon(std::span<const Vec2> corners) {
  const std::string_view fault = polygon_fault(corners);
  if (!fault.empty()) return {nullptr, std::string(fault)};
  ConvexPolygon polygon;
  for (const Vec2& corner : corners) polygon.corners.emplace_back(corner.x, corner.y);
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vector2 edge = polygon.corners[(k + 1) % corners.size()] - polygon.corners[k];
    polygon.normals.push_back(Vector2(edge.y(), -edge.x()).normalized());
  }
  return {std::make_shared<const StoredGeometry>(StoredGeometry{std::move(polygon)}), {}};
}

}  // namespace cradle
