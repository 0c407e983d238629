/// Geometry that does not fit a Shape: hulls, triangle meshes, compounds, height fields. Immutable
/// once made, shared by all bodies that name it, and held by the world under a number.
///
/// Lengths in m, in the frame B of the body that has the geometry. Made by the functions below,
/// which tell in words what is wrong: the reason goes on after "it" or "the points".
#pragma once

#include <cradle/types.h>

#include <array>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "server/collision/geometry.h"

namespace cradle {

class BoxTree;

/// Corners of a triangle, counter-clockwise as seen from outside: indices of vertices.
using Triangle = std::array<std::int32_t, 3>;

/// What bodies on the outer side of a surface can feel of one of its edges.
enum class EdgeKind : std::uint8_t {
  inner,   ///< flat or a valley: nothing, the triangles beside it say all
  ridge,   ///< the surface bends away
  border,  ///< it ends
};

/// The solid within a closed surface, or for bodies that do not yield also an open surface.
struct TriangleMesh {
  std::vector<Vector> vertices;  ///< each place once
  std::vector<Triangle> triangles;
  bool is_closed = false;

  // The rest follows from the above; `complete` makes it.
  /// Unit, outward; a triangle without area has that of the neighbour at its longest edge, or zero.
  std::vector<Vector> normals;
  /// The triangle across the edge from corner k to the next; negative: none.
  std::vector<std::array<std::int32_t, 3>> neighbours;
  std::vector<std::array<EdgeKind, 3>> edges;  ///< likewise
  Aabb box;
  double reach = 0;                     ///< m, of the farthest vertex from Bo
  double thickness = 0;                 ///< m, closed: volume by area, a plate's half; open: 0
  Vector origin = Vector::Zero();       ///< of the boxes in the tree
  std::shared_ptr<const BoxTree> tree;  ///< over the triangles
};

/// Ground: heights over a grid that is centred on Bo, in two triangles a cell. Solid below.
struct HeightField {
  std::int32_t rows = 0, columns = 0;       ///< at least two of each
  double spacing_x_m = 0, spacing_y_m = 0;  ///< of columns along x, of rows along y
  std::vector<double> heights;              ///< m, z; row after row, each along x
  double lowest = 0, highest = 0;           ///< of them: `make_height_field` makes it

  double x(std::int32_t column) const { return (column - 0.5 * (columns - 1)) * spacing_x_m; }
  double y(std::int32_t row) const { return (row - 0.5 * (rows - 1)) * spacing_y_m; }
  double height(std::int32_t row, std::int32_t column) const {
    return heights[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                   static_cast<std::size_t>(column)];
  }
};

/// Vertices of a hull side by side, some of them perhaps twice: m, and their numbers.
struct alignas(16) FourVertices {
  std::array<double, 4> x, y, z;
  std::array<std::uint16_t, 4> numbers;
};

/// Where the fours of a cell begin, and how many there are.
struct FoursOfCell {
  std::uint16_t first, count;
};

/// A convex polyhedron. Faces are convex polygons; none is coplanar with its neighbour.
struct ConvexHull {
  std::vector<Vector> vertices;     ///< all are corners, in the order they were given in
  std::vector<std::int32_t> loops;  ///< corners of face after face, counter-clockwise
  std::vector<std::int32_t> first = {
      0};  ///< face f has the corners loops[first[f] .. first[f + 1]-1]

  // The rest follows from the above; `complete` makes it.
  std::vector<Vector> normals;        ///< of the faces, unit, outward
  std::vector<double> offsets;        ///< m; face f lies in the plane normals[f] . p = offsets[f]
  std::vector<std::int32_t> face_at;  ///< the face that a place in `loops` belongs to
  std::vector<std::int32_t> edge_at;  ///< number of the edge from there to the loop's next corner
  std::vector<std::int32_t> beyond;   ///< the face on the other side of that edge
  /// Places in `loops` where a face has vertex v: around[around_first[v] .. around_first[v + 1]-1]
  std::vector<std::int32_t> around, around_first;
  std::vector<std::int32_t> neighbours;  ///< of v: the next corner, for each of `around`
  std::vector<Vector> edges_along;       ///< unit, from v to each of these
  std::vector<std::int32_t> widest;      ///< the faces with most area, largest first, at most 256
  /// Vertices that may be farthest along a direction of cell c of a DirectionGrid: those of
  /// likely[likely_of[c].first] and the fours after it. Empty for hulls of very many vertices; of
  /// 42 about 50 KB.
  std::vector<FourVertices> likely;
  std::vector<FoursOfCell> likely_of;
  /// Faces that are level with each other and hang together carry as one panel: that of face f is
  /// panel_of[f], negative: none. Its corners, counter-clockwise, are at the places
  /// panel_places[panel_first[k] .. panel_first[k + 1]-1] in `loops`.
  std::vector<std::int32_t> panel_of, panel_places, panel_first = {0};
  Vector lower = Vector::Zero(), upper = Vector::Zero();  ///< m, of the box that holds it
  Vector centre = Vector::Zero();                         ///< m, mean of the vertices
  double inner_radius = 0;  ///< m, of a ball about `centre` that the hull holds
  /// Of each face: the normals of all faces at any of its corners are within the angle with this
  /// cosine of some direction, 0: not all; and those of the two faces at any of its edges.
  std::vector<double> corner_cosines, edge_cosines;

  std::size_t face_count() const { return first.size() - 1; }
  std::span<const std::int32_t> face(std::size_t f) const {
    const auto begin = static_cast<std::size_t>(first[f]);
    return std::span(loops).subspan(begin, static_cast<std::size_t>(first[f + 1]) - begin);
  }
};

struct StoredGeometry;
using GeometryPointer = std::shared_ptr<const StoredGeometry>;

/// One shape of a compound. Where parts overlap, their masses add up.
struct CompoundPart {
  Shape shape;               ///< of a hull or mesh only the kind counts
  GeometryPointer geometry;  ///< a hull, mesh or polygon of many corners; else null
  Vector p_BoPo = Vector::Zero();
  Rotation q_BP = Rotation::Identity();
  double density_kgpm3 = 1000;  ///< above 0
};

struct Compound {
  std::vector<CompoundPart> parts;

  // The rest follows from the parts; `make_compound` makes it.
  std::vector<Pose> X_BP;
  Aabb box;                             ///< of all parts, in B; roomy enough for planar worlds, too
  std::shared_ptr<const BoxTree> tree;  ///< over the boxes of the parts that can touch
};

/// The hull of planar worlds: polygons that have more corners than fit a Shape.
struct ConvexPolygon {
  std::vector<Vector2> corners;  ///< counter-clockwise, as polygon_fault wants them
  std::vector<Vector2> normals;  ///< outward; k of the edge from corner k to the next
};

struct StoredGeometry {
  std::variant<ConvexHull, TriangleMesh, Compound, HeightField, ConvexPolygon> value;
  ShapeKind kind() const;  ///< of a ConvexPolygon: hull
};

/// A geometry, or why there is none.
struct MadeGeometry {
  GeometryPointer geometry;  ///< null if refused
  std::string fault;
};

/// The convex hull. Refuses fewer than four points, points that are (nearly) in one plane, not
/// finite or beyond the limits.
MadeGeometry make_hull(std::span<const Vector> points);

/// Fills in what follows from vertices and faces.
void complete(ConvexHull& hull);

/// Of these, the panels; the neighbours of faces must be known.
void add_panels(ConvexHull& hull);

/// Fills in what follows from vertices and triangles, in O(n log n).
void complete(TriangleMesh& mesh);

/// Vertices at the same place become one; those that no triangle has are left out. Refuses what is
/// no surface of a solid: triangles that disagree about which side is outside, an edge of three
/// triangles, a closed surface that is inside out as a whole or in a part, or encloses nothing. An
/// open surface is taken, with is_closed false.
MadeGeometry make_mesh(std::span<const Vector> vertices, std::span<const Triangle> triangles);

/// `heights` row after row. Refuses fewer than two rows or columns, too many heights, another
/// number of them than rows times columns, spacings that are not above 0, and what is not finite or
/// beyond the limits.
MadeGeometry make_height_field(std::int32_t rows, std::int32_t columns, double spacing_x_m,
                               double spacing_y_m, std::vector<double> heights);

/// Refuses no parts, too many, parts that are no solid, compounds of compounds and densities that
/// are not above 0. Sizes and poses of the parts must have been validated.
MadeGeometry make_compound(std::vector<CompoundPart> parts);

/// Refuses what `polygon_fault` names.
MadeGeometry make_polygon(std::span<const Vec2> corners);

/// Why a mesh is open: which edge has a triangle on one side only. Empty if it is closed.
std::string open_edge(const TriangleMesh& mesh);

}  // namespace cradle
