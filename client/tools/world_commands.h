/// The subcommands that send a command to the world: spawn, push, remove, clear, gravity, pause,
/// resume, step, shutdown.
#pragma once

#include <CLI/CLI.hpp>

#include "session.h"

namespace cradle::tool {

/// Adds them to `app`; parsing sets `action` to the one that was named.
void add_world_commands(CLI::App& app, Action& action);

}  // namespace cradle::tool
