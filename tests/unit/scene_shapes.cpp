// Shapes of scenes: capsules to compounds, meshes from files, and how wrong ones are refused.
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "server/dynamics/mass_distribution.h"
#include "server/mesh_file.h"
#include "server/simulate.h"
#include "tests/unit/scene_helpers.h"

namespace cradle {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

const std::string kTetrahedron =
    "points_m = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
    "triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]\n";
const std::string kCubeObj =
    "# a cube of 2 m, its faces as quads\nmtllib no.mtl\no cube\n"
    "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
    "vt 0 0\nvn 0 0 1\ns off\nusemtl none\n"
    "f 4 3 2 1\nf 5/1 6/1 7/1 8/1\r\nf 1//1 2//1 6//1 5//1\nf 2/1/1 3/1/1 7/1/1 6/1/1\n"
    "f -6 -5 -1 -2  # 3 4 8 7\nf 4 1 5 8\n";

/// A folder of its own, with files in it, gone at the end.
class ShapesFolder {
 public:
  ShapesFolder() : path_(std::filesystem::temp_directory_path() / ("cradle-shapes-" + own_name())) {
    std::filesystem::create_directories(path_);
  }
  ~ShapesFolder() { std::filesystem::remove_all(path_); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name) << text;
    return (path_ / name).string();
  }

 private:
  static std::string own_name() {
    static int count = 0;
    return std::to_string(::getpid()) + "-" + std::to_string(++count);
  }
  std::filesystem::path path_;
};

double mass_of(const Scene& scene, std::size_t geometry, double density = 1000) {
  return mass_distribution(*scene.geometries.at(geometry), density).mass_kg;
}

std::string obj_refusal(const std::string& text) {
  try {
    parse_obj(text, "m.obj");
  } catch (const MeshFileError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("shapes of a kind and sizes are read") {
  const auto shape = [](const std::string& lines) {
    return scene_of("[[body]]\n" + lines).bodies[0].shape;
  };
  const std::string sizes = "\nradius_m = 0.25\nhalf_length_m = 2";
  CHECK(shape("shape = 'capsule'" + sizes) == Shape::capsule(0.25, 2));
  CHECK(shape("shape = 'cylinder'" + sizes) == Shape::cylinder(0.25, 2));
  CHECK(shape("shape = 'cone'" + sizes) == Shape::cone(0.25, 2));
  CHECK(shape("shape = 'ellipsoid'\nhalf_extents_m = [1, 2, 3]") == Shape::ellipsoid({1, 2, 3}));
}

TEST_CASE("hulls, meshes and compounds are read, and numbered in the order of the bodies") {
  const Scene scene = scene_of(
      "[[body]]\nshape = 'hull'\n" + kTetrahedron.substr(0, kTetrahedron.find('\n')) +
      "\n[[body]]\nshape = 'sphere'\nradius_m = 1\n[[body]]\nshape = 'mesh'\n" + kTetrahedron +
      "[[body]]\nshape = 'compound'\n"
      "[[body.part]]\nshape = 'box'\nhalf_extents_m = [1, 1, 1]\n"
      "[[body.part]]\nshape = 'mesh'\ndensity_kgpm3 = 6000\n"
      "position_m = [5, 0, 0]\n" +
      kTetrahedron);
  REQUIRE(scene.geometries.size() == 3);
  CHECK(scene.bodies[0].shape == Shape::stored(ShapeKind::hull, 1));
  CHECK(scene.bodies[2].shape == Shape::stored(ShapeKind::mesh, 2));
  CHECK(scene.bodies[3].shape == Shape::stored(ShapeKind::compound, 3));
  CHECK(mass_of(scene, 0) == Approx(1000.0 / 6));
  CHECK(mass_of(scene, 1) == Approx(1000.0 / 6));
  CHECK(mass_of(scene, 2, 1) == Approx(8000 + 1000));
  SceneRun run(scene);
  std::vector<Event> events = run.world().take_events();
  CHECK(events.at(3).mass_kg == Approx(9000));
  CHECK(events.at(3).p_BoBcm.x == Approx(5.25 / 9));
  CHECK(run.world().not_colliding_count() == 0);
}

TEST_CASE("the bodies of a lattice share their geometry") {
  const Scene scene = scene_of(
      "[[lattice]]\ncount = [4, 1, 1]\npitch_m = [3, 3, 3]\n[[lattice.body]]\nshape = 'mesh'\n" +
      kTetrahedron +
      "[[lattice.body]]\nshape = 'compound'\n[[lattice.body.part]]\nshape = 'sphere'\nradius_m = "
      "1\n");
  CHECK(scene.geometries.size() == 2);
  REQUIRE(scene.bodies.size() == 4);
  CHECK(scene.bodies[2].shape == Shape::stored(ShapeKind::mesh, 1));
  CHECK(scene.bodies[3].shape == Shape::stored(ShapeKind::compound, 2));
  CHECK_NOTHROW(SceneRun(scene));
}

TEST_CASE("a mesh comes from an OBJ file beside the scene") {
  const ShapesFolder folder;
  folder.write("cube.obj", kCubeObj);
  const Scene scene =
      load_scene(folder.write("s.toml",
                              "[[body]]\nshape = 'mesh'\nfile = 'cube.obj'\ndensity_kgpm3 = 10\n"
                              "[[body]]\nshape = 'hull'\nfile = 'cube.obj'\nmass_kg = 2\n"
                              "[[body]]\nshape = 'mesh'\nfile = 'cube.obj'\nmass_kg = 3\n"));
  REQUIRE(scene.geometries.size() == 3);
  CHECK(scene.geometries[0] == scene.geometries[2]);  // read once
  for (const std::size_t k : {0U, 1U}) {
    const MassDistribution m = mass_distribution(*scene.geometries[k], 1);
    CHECK(m.mass_kg == Approx(8));
    CHECK((m.G - 2.0 / 3 * Matrix::Identity()).norm() < 1e-14);
  }
}

TEST_CASE("an OBJ file is taken as it is meant, or refused with its line") {
  const MeshFile cube = parse_obj(kCubeObj, "cube.obj");
  CHECK(cube.vertices.size() == 8);
  CHECK(cube.triangles.size() == 12);
  CHECK(make_mesh(cube.vertices, cube.triangles).fault.empty());
  CHECK(parse_obj("", "m.obj").vertices.empty());
  const std::string two = "v 0 0 0\nv 1 0 0\n";
  const std::pair<std::string, std::string> cases[] = {
      {"v 1 2", "m.obj:1: a vertex has three"},
      {"v 1 2 3 1", "m.obj:1: a vertex has three"},
      {"v 1 2 3x", "m.obj:1: '3x' is no number"},
      {"v 1 2 ,5", "m.obj:1: ',5' is no number"},
      {"\nv 1 2 1e999", "m.obj:2: '1e999' is no number"},
      {two + "f 1 2", "m.obj:3: a face has three corners"},
      {two + "f 1 2 3", "m.obj:3: corner 3 of 2"},
      {two + "f 1 2 -3", "m.obj:3: corner -3 of 2"},
      {two + "f 1 2 0", "m.obj:3: '0' is no corner"},
      {two + "f 1 2 1.5", "m.obj:3: '1.5' is no corner"},
      {two + "f 1 2 /1", "m.obj:3: '/1' is no corner"},
      {"v -2 -2 0\nv 2 -2 0\nv 2 2 0\nv 0 -1 0\nv -2 2 0\nf 1 2 3 4 5",
       "m.obj:6: a face of more than three corners must be convex"},
      {"curv 0 1", "m.obj:1: 'curv' is not understood"},
      {"solid stl", "m.obj:1: 'solid' is not understood"},
  };
  for (const auto& [text, refusal] : cases) {
    CAPTURE(text);
    CHECK_THAT(obj_refusal(text), StartsWith(refusal));
  }
}

TEST_CASE("polygons of planar scenes are a shape, or with many corners a hull of the scene") {
  const std::string planar = "[world]\nplanar = true\n", body = "[[body]]\nshape = 'polygon'\n";
  const std::string triangle = body + "points_m = [[0, 0, 0], [2, 0, 0], [0, 1, 0]]\n";
  const std::string five =
      body + "points_m = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0.5, 1.5, 0], [0, 1, 0]]\n";
  const Scene scene = scene_of(planar + triangle + five);
  CHECK(scene.bodies[0].shape == Shape::polygon({0, 0}, {2, 0}, {0, 1}));
  CHECK(scene.bodies[1].shape == Shape::stored(ShapeKind::hull, 1));
  REQUIRE(scene.geometries.size() == 1);
  CHECK(std::get<ConvexPolygon>(scene.geometries[0]->value).corners.size() == 5);

  const auto refuses = [](const std::string& text, const std::string& reason) {
    CHECK_THAT(scene_refusal(text), Contains(reason));
  };
  refuses(triangle, "a polygon is a shape of planar worlds alone (body 1)");
  refuses(five, "a polygon is a shape of planar worlds alone (body 1)");
  refuses(planar + "[[body]]\nshape = 'cylinder'\nradius_m = 1\nhalf_length_m = 1\n",
          "its shape is none of a planar world: sphere, box, capsule, polygon, half_space or "
          "compound (body 1)");
  refuses(planar + body, "x.toml:4: shape: needs points_m");
  refuses(planar + triangle + "radius_m = 1\n", "radius_m: this shape has none");
  refuses(planar + body + "points_m = [[0, 0, 0], [0, 1, 0], [2, 0, 0]]\n",
          "x.toml:5: points_m: the polygon is not convex with its corners counter-clockwise");
  refuses(planar + body + "points_m = [[0, 0, 0], [1, 0, 0], [0, 1, 1]]\n",
          "the corners of a polygon must have z = 0");
  const std::string compound = planar + "[[body]]\nshape = 'compound'\n[[body.part]]\n";
  refuses(compound + "shape = 'box'\nhalf_extents_m = [1, 1, 1]\nposition_m = [0, 0, 1]\n",
          "a part of it leaves the plane z = 0, or is turned about another axis than z");
  refuses(compound + "shape = 'ellipsoid'\nhalf_extents_m = [1, 1, 1]\n",
          "a part of it has a shape that is none of a planar world");
}

TEST_CASE("shapes that are none are refused with line, reason and body") {
  const std::string body = "[[body]]\nname = 'b'\nshape = ",
                    compound = body + "'compound'\n[[body.part]]\n";
  const std::string turned =
      "points_m = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
      "triangles = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]";
  const std::string open =
      "points_m = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
      "triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2]]";
  const std::pair<std::string, std::string> cases[] = {
      {body + "'capsule'\nradius_m = 1", "x.toml:3: shape: needs half_length_m"},
      {body + "'cone'\nhalf_length_m = 1", "x.toml:3: shape: needs radius_m"},
      {body + "'cylinder'\nradius_m = -1\nhalf_length_m = 1", "x.toml:4: radius_m: sizes must be"},
      {body + "'cylinder'\nradius_m = 1\nhalf_length_m = 0", "x.toml:5: half_length_m: sizes must"},
      {body + "'sphere'\nradius_m = 1\nhalf_length_m = 1",
       "x.toml:5: half_length_m: this shape has"},
      {body + "'sphere'\nradius_m = 1\nfile = 'a.obj'", "x.toml:5: file: this shape has none"},
      {body + "'sphere'\nradius_m = 1\npoints_m = []", "x.toml:5: points_m: this shape has none"},
      {body + "'sphere'\nradius_m = 1\n[[body.part]]\nshape = 'box'", "x.toml:5: part: this shape"},
      {body + "'hull'", "x.toml:3: shape: needs points_m"},
      {body + "'mesh'\npoints_m = []", "x.toml:3: shape: needs triangles"},
      {body + "'hull'\npoints_m = [[0, 0, 0], [1, 0]]",
       "x.toml:4: points_m: must be lists of 3 numbers"},
      {body + "'hull'\npoints_m = [[0, 0, 0], [1, 0, 'x']]",
       "x.toml:4: points_m: must be lists of 3 numbers, not of type string"},
      {body + "'hull'\npoints_m = [[0, 0, 0]]", "x.toml:4: points_m: a hull needs four points"},
      {body + "'hull'\npoints_m = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [3, 2, 0]]",
       "x.toml:4: points_m: the points are all in one plane; a hull must be wider than 1e-4 m in "
       "every direction, and than 1e-7 of its length (body \"b\")"},
      {body + "'mesh'\n" + turned,
       "x.toml:5: triangles: the mesh is inside out: its triangles run clockwise as seen from "
       "outside; turn all its triangles round: swap two corners of each (body \"b\")"},
      {body + "'mesh'\n" + open,
       "x.toml:3: shape: a dynamic body needs a closed mesh, and this one is open: the edge from "},
      {body + "'mesh'\npoints_m = [[0, 0, 0]]\ntriangles = [[0, 0, 1]]",
       "x.toml:5: triangles: there is no point 1 (from 0) of 1"},
      {body + "'mesh'\nfile = 'a.stl'", "x.toml:4: file: \"a.stl\" is no .obj file"},
      {body + "'mesh'\nfile = 'a.obj'\n" + kTetrahedron, "x.toml:5: points_m: this shape has none"},
      {body + "'mesh'\nfile = 'no/such.obj'", "x.toml:4: file: no/such.obj: No such file"},
      {body + "'compound'", "x.toml:3: shape: needs part"},
      {compound, "x.toml:4: shape: is missing (body \"b\")"},
      {compound + "shape = 'half_space'", "x.toml:5: shape: \"half_space\" is none of sphere"},
      {compound + "shape = 'compound'", "x.toml:5: shape: \"compound\" is none of sphere"},
      {compound + "shape = 'sphere'\nradius_m = 0", "x.toml:6: radius_m: sizes must be positive"},
      {compound + "shape = 'sphere'\nradius_m = 1\ndensity_kgpm3 = 0",
       "x.toml:7: density_kgpm3: must be above 0 (body \"b\")"},
      {compound + "shape = 'sphere'\nradius_m = 1\nposition_m = [1e9, 0, 0]",
       "x.toml:7: position_m: out of range"},
      {compound + "shape = 'sphere'\nradius_m = 1\norientation_wxyz = [0, 0, 0, 0]",
       "x.toml:7: orientation_wxyz: a quaternion"},
      {compound + "shape = 'mesh'\n" + open,
       "x.toml:5: shape: a part needs a closed mesh, and this one is open"},
      {body + "'compound'\ndensity_kgpm3 = 2\n[[body.part]]\nshape = 'sphere'\nradius_m = 1",
       "x.toml:4: density_kgpm3: the parts of a compound"},
      {"[[body]]\nmass_kg = 1\n[[body]]\nshape = 'cone'\nradius_m = 1\nhalf_length_m = 1\nmass_kg "
       "= -2",
       "x.toml:7: mass_kg: must be above 0 (body 2)"},
  };
  for (const auto& [text, refusal] : cases) {
    CAPTURE(text);
    CHECK_THAT(scene_refusal(text), StartsWith(refusal));
  }
  const std::string field = "[[body]]\nname = 'b'\nkind = 'static'\nshape = 'height_field'\n";
  const std::pair<std::string, std::string> fields[] = {
      {field + "spacing_m = [1, 1]", "x.toml:4: shape: needs heights_m or file"},
      {field + "heights_m = [[0, 0], [0, 0]]", "x.toml:4: shape: needs spacing_m"},
      {field + "spacing_m = [1, 1]\nheights_m = [[0, 0], [0]]",
       "x.toml:6: heights_m: row 1 has 1 heights, and row 0 has 2 (body \"b\")"},
      {field + "spacing_m = [1, 1]\nheights_m = [[0, 0]]",
       "x.toml:6: heights_m: the height field has fewer than two rows or columns"},
      {field + "spacing_m = [1, 1]\nheights_m = [[0, nan], [0, 0]]",
       "x.toml:6: heights_m: the height field has in row 0, column 1, a height that is out of "
       "range"},
      {field + "spacing_m = [1, 0]\nheights_m = [[0, 0], [0, 0]]",
       "x.toml:6: heights_m: the height field has cells that are too small"},
      {field + "spacing_m = [1, 1]\nheights_m = [[0, 'x'], [0, 0]]",
       "x.toml:6: heights_m: must be lists of numbers, not of type string"},
      {field + "spacing_m = [1, 1]\nheights_m = [0, 0]",
       "x.toml:6: heights_m: must be lists of numbers"},
      {field + "spacing_m = [1, 1]\npoints_m = [[0, 0, 0]]\nheights_m = [[0, 0], [0, 0]]",
       "x.toml:6: points_m: this shape has none"},
      {field + "spacing_m = [1, 1]\nfile = 'no/such.txt'", "x.toml:6: file: no/such.txt: No such"},
      {body + "'sphere'\nradius_m = 1\nheights_m = [[0]]", "x.toml:5: heights_m: this shape has"},
      {body + "'sphere'\nradius_m = 1\nspacing_m = [1, 1]", "x.toml:5: spacing_m: this shape has"},
      {body + "'height_field'\nspacing_m = [1, 1]\nheights_m = [[0, 0], [0, 0]]",
       "x.toml:3: shape: a height_field must not be dynamic (body \"b\")"},
  };
  for (const auto& [text, refusal] : fields) {
    CAPTURE(text);
    CHECK_THAT(scene_refusal(text), StartsWith(refusal));
  }
  // A body that is not dynamic may have an open surface: terrain.
  CHECK(scene_refusal("[[body]]\nkind = 'static'\nshape = 'mesh'\n" + open).empty());
}

TEST_CASE("a height field from a file is the one from the scene") {
  const ShapesFolder folder;
  folder.write("heights.txt", "# three rows\n0 0.5, 1 \r\n\n-1 0 2e-1\n1 1 1\n");
  const std::string head =
      "[[body]]\nkind = 'static'\nshape = 'height_field'\nspacing_m = [2, 1]\n";
  const Scene from_file = load_scene(folder.write("file.toml", head + "file = 'heights.txt'\n"));
  const Scene inside = load_scene(
      folder.write("inside.toml", head + "heights_m = [[0, 0.5, 1], [-1, 0, 0.2], [1, 1, 1]]\n"));
  for (const Scene* scene : {&from_file, &inside}) {
    const auto& field = std::get<HeightField>(scene->geometries.at(0)->value);
    CHECK(field.rows == 3);
    CHECK(field.columns == 3);
    CHECK(field.x(2) == 2);
    CHECK(field.y(0) == -1);
    CHECK(field.height(1, 2) == 0.2);
    CHECK(field.lowest == -1);
    CHECK(field.highest == 1);
  }
  CHECK_THROWS_WITH(parse_heights("1 2\n3 x\n", "h.txt"), "h.txt:2: 'x' is no number");
}

}  // namespace cradle
