/// Drag and springs of a scene.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>

#include "server/toml_reader.h"
#include "server/world/forces.h"

namespace cradle {

/// The keys of [[spring]]; tests/scenes/README.md documents them.
inline constexpr std::array<std::string_view, 7> kSpringKeys{
    "body_a", "body_b", "point_a_m", "point_b_m", "stiffness_npm", "damping_nspm", "rest_length_m"};

/// A spring of a scene; its bodies are named by their places in the list.
struct SceneSpring {
  std::size_t a = 0;
  std::optional<std::size_t> b;  ///< none: the world
  Spring spring;                 ///< without bodies
};

/// The drag keys of a body of this kind.
Drag read_drag(const TomlTable& body, BodyKind kind);

/// A [[spring]] between two of `bodies`, or one of them and the world.
SceneSpring read_spring(const TomlTable& table, std::span<const BodySpec> bodies);

}  // namespace cradle
