// A height field as triangles. Cell (row, column) has the samples
//
//     d --- c      row + 1
//     |   / |
//     | /   |
//     a --- b      row
//
// and the triangles 2 i: a b c, and 2 i + 1: a c d, where i counts cells row after row. Nothing is
// kept but the heights: neighbours follow from the numbers, normals and edges from heights.
#include "server/collision/surface.h"

#include <algorithm>
#include <cmath>

namespace cradle {

SurfaceTriangle SurfaceView::triangle_of_field(std::int32_t t) const {
  const std::int32_t cell = t / 2, width = field_->columns - 1;
  const std::int32_t row = cell / width, column = cell % width;
  const auto sample = [&](std::int32_t down, std::int32_t right) {
    return Vector(field_->x(column + right), field_->y(row + down),
                  field_->height(row + down, column + right));
  };
  const std::int32_t a = row * field_->columns + column, c = a + field_->columns + 1;
  SurfaceTriangle triangle;
  triangle.number = t;
  if (t % 2 == 0) {
    triangle.corners = {sample(0, 0), sample(0, 1), sample(1, 1)};
    triangle.vertices = {a, a + 1, c};
  } else {
    triangle.corners = {sample(0, 0), sample(1, 1), sample(1, 0)};
    triangle.vertices = {a, c, c - 1};
  }
  const auto& p = triangle.corners;
  triangle.normal = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
  return triangle;
}

EdgeKind SurfaceView::edge_kind(const SurfaceTriangle& t, std::size_t k) const {
  if (mesh_ != nullptr) return mesh_->edges[static_cast<std::size_t>(t.number)][k];
  const std::int32_t u = neighbour(t, k);
  if (u < 0) return EdgeKind::border;
  return kind_of_edge(t.normal, triangle_of_field(u).normal, t.corners[(k + 1) % 3] - t.corners[k]);
}

std::int32_t SurfaceView::neighbour(const SurfaceTriangle& t, std::size_t k) const {
  if (mesh_ != nullptr) return mesh_->neighbours[static_cast<std::size_t>(t.number)][k];
  const std::int32_t width = field_->columns - 1, height = field_->rows - 1;
  const std::int32_t row = t.number / 2 / width, column = t.number / 2 % width;
  if (t.number % 2 == 0) {
    if (k == 0) return row > 0 ? t.number - 2 * width + 1 : -1;
    if (k == 1) return column + 1 < width ? t.number + 3 : -1;
    return t.number + 1;
  }
  if (k == 0) return t.number - 1;
  if (k == 1) return row + 1 < height ? t.number + 2 * width - 1 : -1;
  return column > 0 ? t.number - 3 : -1;
}

namespace {

/// The cell that holds `x`, of cells from `first` on; in range, whatever x is.
std::int32_t cell_at(double x, double first, double spacing, std::int32_t cells) {
  const double at = std::floor((x - first) / spacing);
  return static_cast<std::int32_t>(std::clamp(at, 0.0, static_cast<double>(cells - 1)));
}

}  // namespace

SurfaceView::Cells SurfaceView::cells_in(const Aabb& box) const {
  const double x0 = field_->x(0), y0 = field_->y(0);
  const double dx = field_->spacing_x_m, dy = field_->spacing_y_m;
  if (box.lower.x() > -x0 || box.upper.x() < x0 || box.lower.y() > -y0 || box.upper.y() < y0) {
    return {0, 0, 0, 0};
  }
  // A cell more on each side than there are whole ones: rounding may not lose any.
  constexpr double kRounding = 1e-9;
  const std::int32_t width = field_->columns - 1, height = field_->rows - 1;
  return {cell_at(box.lower.y() - kRounding * dy, y0, dy, height),
          cell_at(box.upper.y() + kRounding * dy, y0, dy, height) + 1,
          cell_at(box.lower.x() - kRounding * dx, x0, dx, width),
          cell_at(box.upper.x() + kRounding * dx, x0, dx, width) + 1};
}

std::int32_t SurfaceView::triangle_at(double x, double y) const {
  const double x0 = field_->x(0), y0 = field_->y(0);
  if (!(std::abs(x) <= -x0 && std::abs(y) <= -y0)) return -1;
  const double dx = field_->spacing_x_m, dy = field_->spacing_y_m;
  const std::int32_t row = cell_at(y, y0, dy, field_->rows - 1);
  const std::int32_t column = cell_at(x, x0, dx, field_->columns - 1);
  const bool is_upper = (y - field_->y(row)) * dx > (x - field_->x(column)) * dy;
  return 2 * (row * (field_->columns - 1) + column) + (is_upper ? 1 : 0);
}

}  // namespace cradle
