/// Scene files (TOML): a world's settings, its bodies, and what pushes them when.
///
/// README.md of tests/scenes documents every key. A file is refused as a whole, with line and
/// reason.
#pragma once

#include <cradle/types.h>

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "server/collision/stored_geometry.h"
#include "server/scene_forces.h"
#include "server/world/settings.h"

namespace cradle {

/// A wrench of a scene: begins before the step of `tick`; its body is named by its place in the
/// list.
struct TimedWrench {
  Tick tick = 1;         ///< 1: before the first step
  std::size_t body = 0;  ///< index into Scene::bodies
  Wrench wrench;         ///< without body
};

struct Scene {
  std::string name;  ///< what it is called in errors: its path
  WorldSettings settings;
  std::vector<GeometryPointer> geometries;  ///< hulls, meshes, ...: bodies name them from 1 on
  std::vector<BodySpec> bodies;             ///< those of [[body]], then those of [[lattice]]
  std::vector<Drag> drags;                  ///< of `bodies`, one each; or none at all
  std::vector<TimedWrench> wrenches;        ///< in ascending order of ticks
  std::vector<SceneSpring> springs;
};

/// "FILE:LINE: reason"
class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws SceneError, and std::filesystem::filesystem_error if the file cannot be read.
Scene load_scene(const std::string& path);
/// `name` stands for FILE. Throws SceneError.
Scene parse_scene(std::string_view text, const std::string& name);

}  // namespace cradle
