/// What each command does to the world and to the run of time; one short function a command.
#pragma once

#include <optional>
#include <vector>

#include "protocol/command.h"
#include "server/world/world.h"

namespace cradle {

/// What clients may do beside moving bodies; from the configuration.
struct Permissions {
  bool control = true;  ///< pause, resume, step
  bool shutdown = false;
};

/// A step command that is being worked off.
struct PendingSteps {
  CommandHeader header;
  Tick until = 0;  ///< its answer is due when this tick is done
};

/// How time runs.
struct RunState {
  bool paused = false;
  bool lockstep = false;
  bool shutdown = false;
  std::vector<PendingSteps> pending;  ///< in the order they came; `until` ascends

  /// True if the world steps when its time has come.
  bool is_stepping(Tick tick) const {
    return (!paused && !lockstep) || (!pending.empty() && pending.back().until > tick);
  }
};

/// Applies one command between two steps. `queued` for step commands, whose answer comes later;
/// every other outcome is final.
Outcome apply(const Command& command, World& world, RunState& run, const Permissions& permissions);

}  // namespace cradle
