/// The triangles of a mesh or a height field, with their neighbours: what contact asks of either.
///
/// Everything in the frame S of the body that has the surface, m. Triangles have numbers from 0.
#pragma once

#include "server/collision/box_tree.h"
#include "server/collision/collider.h"
#include "server/collision/fetch.h"
#include "server/collision/tolerances.h"

namespace cradle {

struct SurfaceTriangle {
  std::int32_t number = 0;
  std::array<Vector, 3> corners;         ///< counter-clockwise as seen from outside
  std::array<std::int32_t, 3> vertices;  ///< their numbers
  Vector normal;                         ///< unit, outward; zero: a triangle that touches nothing

  /// Unit, from corner k to the next.
  Vector edge(std::size_t k) const { return (corners[(k + 1) % 3] - corners[k]).normalized(); }
};

/// Of an edge between triangles with the normals `n` and `n_beyond`; `edge` runs along it as the
/// corners of the first do.
EdgeKind kind_of_edge(const Vector& n, const Vector& n_beyond, const Vector& edge);

/// Refers to the geometry of a mesh or a height field.
class SurfaceView {
 public:
  /// Of other shapes, and without geometry: is_there() is false, and nothing else may be asked.
  explicit SurfaceView(const Collider& collider) {
    if (collider.geometry == nullptr) return;
    mesh_ = std::get_if<TriangleMesh>(&collider.geometry->value);
    field_ = std::get_if<HeightField>(&collider.geometry->value);
  }

  bool is_there() const { return mesh_ != nullptr || field_ != nullptr; }
  const TriangleMesh* mesh() const { return mesh_; }
  const HeightField* field() const { return field_; }

  Aabb box() const {
    return mesh_ != nullptr ? mesh_->box
                            : Aabb{{field_->x(0), field_->y(0), field_->lowest},
                                   {-field_->x(0), -field_->y(0), field_->highest}};
  }

  SurfaceTriangle triangle(std::int32_t t) const {
    return mesh_ != nullptr ? triangle_of_mesh(t) : triangle_of_field(t);
  }
  /// Fetches what `triangle` reads.
  void expect(std::int32_t t) const {
    if (mesh_ == nullptr) return;
    fetch(&mesh_->normals[static_cast<std::size_t>(t)]);
    fetch(&mesh_->triangles[static_cast<std::size_t>(t)]);
  }
  EdgeKind edge_kind(const SurfaceTriangle& t, std::size_t k) const;
  /// The number of the triangle across the edge from corner k to the next; negative: none.
  std::int32_t neighbour(const SurfaceTriangle& t, std::size_t k) const;

  /// Calls `visit(number)` for every triangle whose box overlaps `box`, which is not empty, and
  /// now and then for one close by; in an order that depends on the surface alone.
  template <class F>
  void for_each_in(const Aabb& box, F&& visit) const {
    if (mesh_ != nullptr) {
      mesh_->tree->query(to_float(box, mesh_->origin), visit);
    } else {
      for_each_of_field(box, visit);
    }
  }

  /// Of a height field: the triangle over or under the point; negative: none.
  std::int32_t triangle_at(double x, double y) const;

 private:
  SurfaceTriangle triangle_of_mesh(std::int32_t t) const {
    const auto i = static_cast<std::size_t>(t);
    SurfaceTriangle triangle;
    triangle.number = t;
    triangle.normal = mesh_->normals[i];
    triangle.vertices = mesh_->triangles[i];
    for (std::size_t k = 0; k < 3; ++k) {
      triangle.corners[k] = mesh_->vertices[static_cast<std::size_t>(triangle.vertices[k])];
    }
    return triangle;
  }
  SurfaceTriangle triangle_of_field(std::int32_t t) const;

  /// Rows and columns of cells that may overlap a box: from the first up to, not with, the end.
  struct Cells {
    std::int32_t first_row, end_row, first_column, end_column;
  };
  Cells cells_in(const Aabb& box) const;

  template <class F>
  void for_each_of_field(const Aabb& box, F&& visit) const {
    if (box.lower.z() > field_->highest || box.upper.z() < field_->lowest) return;
    const Cells cells = cells_in(box);
    for (std::int32_t row = cells.first_row; row < cells.end_row; ++row) {
      for (std::int32_t column = cells.first_column; column < cells.end_column; ++column) {
        const double a = field_->height(row, column), b = field_->height(row, column + 1),
                     c = field_->height(row + 1, column + 1), d = field_->height(row + 1, column);
        const auto is_hit = [&](double other) {
          return std::min({a, other, c}) <= box.upper.z() &&
                 std::max({a, other, c}) >= box.lower.z();
        };
        const std::int32_t t = 2 * (row * (field_->columns - 1) + column);
        if (is_hit(b)) visit(t);
        if (is_hit(d)) visit(t + 1);
      }
    }
  }

  const TriangleMesh* mesh_ = nullptr;
  const HeightField* field_ = nullptr;
};

constexpr bool is_surface(ShapeKind kind) {
  return kind == ShapeKind::mesh || kind == ShapeKind::height_field;
}

}  // namespace cradle
