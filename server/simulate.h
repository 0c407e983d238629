/// `cradled simulate`: a scene, the same core, no network, as fast as it goes.
#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "server/scene.h"
#include "server/world/world.h"

namespace cradle {

/// A scene in motion: the world with its bodies in it, and the wrenches still to come.
class SceneRun {
 public:
  /// Throws SceneError if the world refuses a body.
  explicit SceneRun(Scene scene);

  /// Begins the wrenches that are due, then steps once.
  StepReport step(Executor& executor, StepObserver* observer = nullptr);

  World& world() { return world_; }
  const World& world() const { return world_; }
  /// The id of the scene's body number `index`.
  BodyId id(std::size_t index) const;
  const Scene& scene() const { return scene_; }

 private:
  Scene scene_;
  World world_;
  BodyId first_;
  std::size_t next_wrench_ = 0;
};

}  // namespace cradle
