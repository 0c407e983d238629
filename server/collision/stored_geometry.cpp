#include "server/collision/stored_geometry.h"

#include <cradle/limits.h>

#include <cmath>

namespace cradle {

ShapeKind StoredGeometry::kind() const {
  static_assert(static_cast<int>(ShapeKind::mesh) == static_cast<int>(ShapeKind::hull) + 1);
  static_assert(static_cast<int>(ShapeKind::compound) == static_cast<int>(ShapeKind::hull) + 2);
  return static_cast<ShapeKind>(static_cast<std::size_t>(ShapeKind::hull) + value.index());
}

namespace {

std::string fault_of(const CompoundPart& part) {
  const ShapeKind kind = part.shape.kind;
  if (kind == ShapeKind::compound) return "is a compound itself";
  if (is_stored(kind)) {
    if (!part.geometry || part.geometry->kind() != kind) return "has no geometry";
    const auto* mesh = std::get_if<TriangleMesh>(&part.geometry->value);
    if (mesh && !mesh->is_closed) return "is open: " + open_edge(*mesh);
  } else if (size_count(kind) == 0) {
    return "is no solid";
  }
  if (!(part.density_kgpm3 > 0 && std::isfinite(part.density_kgpm3))) {
    return "has no density above 0";
  }
  return {};
}

}  // namespace

MadeGeometry make_compound(std::vector<CompoundPart> parts) {
  if (parts.empty()) return {nullptr, "has no parts"};
  if (parts.size() > static_cast<std::size_t>(limits::kParts))
    return {nullptr, "has too many parts"};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::string fault = fault_of(parts[i]);
    if (!fault.empty()) return {nullptr, "its part " + std::to_string(i) + " " + fault};
  }
  return {std::make_shared<const StoredGeometry>(StoredGeometry{Compound{std::move(parts)}}), {}};
}

}  // namespace cradle
