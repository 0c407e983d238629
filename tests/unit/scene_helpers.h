/// Small things that the tests of scene and configuration files share.
#pragma once

#include <string>

#include "server/scene.h"

namespace cradle {

/// A scene called "x.toml".
inline Scene scene_of(const std::string& text) { return parse_scene(text, "x.toml"); }

/// Why "x.toml" with this text is refused; empty if it is not.
inline std::string scene_refusal(const std::string& text) {
  try {
    scene_of(text);
  } catch (const SceneError& error) {
    return error.what();
  }
  return {};
}

}  // namespace cradle
