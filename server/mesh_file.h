/// Meshes from files: the geometry of Wavefront OBJ, and nothing else of it. Heights from text.
///
/// Taken are `v x y z` (m) and `f a b c ...` with corners `a`, `a/t`, `a//n` or `a/t/n`, counted
/// from 1, or from the end if negative; faces of more than three corners must be convex. Passed
/// over are comments, and what says nothing about the surface: vt, vn, o, g, s, usemtl, mtllib.
/// Anything else is refused: a guess would be a wrong shape.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "server/collision/stored_geometry.h"

namespace cradle {

struct MeshFile {
  std::vector<Vector> vertices;
  std::vector<Triangle> triangles;
};

/// "NAME:LINE: reason"
class MeshFileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws MeshFileError. `name` is what the file is called there.
MeshFile parse_obj(std::string_view text, const std::string& name);

/// Numbers with space or a comma between them, a row a line; `#` begins a comment. Throws likewise.
std::vector<std::vector<double>> parse_heights(std::string_view text, const std::string& name);

}  // namespace cradle
