/// Commands and answers as values, after decoding and before encoding.
#pragma once

#include <cradle/result.h>
#include <cradle/types.h>

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

namespace cradle {

/// Who sends a command, which of the sender's commands it is, and when it shall take effect.
struct CommandHeader {
  std::int64_t client = 0;    ///< 1 .. limits::kIntegerMax
  std::int64_t sequence = 0;  ///< without gaps, from hello's on
  std::int64_t epoch = 0;     ///< of the world the sender knows; 0 in hello
  Tick target_tick = 0;       ///< 0: the next one
  friend bool operator==(const CommandHeader&, const CommandHeader&) = default;
};

// The lists are atomic: all of it happens, or nothing.
struct Hello {
  std::int32_t protocol_version = 0;
  std::string name;
  friend bool operator==(const Hello&, const Hello&) = default;
};
struct Spawn {
  std::vector<BodySpec> bodies;
  friend bool operator==(const Spawn&, const Spawn&) = default;
};
struct Despawn {
  std::vector<BodyId> bodies;
  friend bool operator==(const Despawn&, const Despawn&) = default;
};
struct Push {
  std::vector<Wrench> wrenches;
  friend bool operator==(const Push&, const Push&) = default;
};
struct ClearWrenches {
  std::vector<BodyId> bodies;
  friend bool operator==(const ClearWrenches&, const ClearWrenches&) = default;
};
struct SetMotion {
  std::vector<Motion> motions;
  friend bool operator==(const SetMotion&, const SetMotion&) = default;
};
struct SetGravity {
  Vec3 gravity_W;  ///< m/s^2
  friend bool operator==(const SetGravity&, const SetGravity&) = default;
};
enum class ControlAction : std::int32_t { pause = 0, resume = 1, step = 2, shutdown = 3 };
struct Control {
  ControlAction action = ControlAction::pause;
  std::int64_t steps = 0;
  friend bool operator==(const Control&, const Control&) = default;
};

using CommandBody =
    std::variant<Hello, Spawn, Despawn, Push, ClearWrenches, SetMotion, SetGravity, Control>;

struct Command {
  CommandHeader header;
  CommandBody body;
  friend bool operator==(const Command&, const Command&) = default;
};

/// What applying a command came to.
struct Outcome {
  Result result = Result::ok;
  BodyId body;            ///< the first body made
  std::int32_t item = 0;  ///< refused batches: the first item at fault
  friend bool operator==(const Outcome&, const Outcome&) = default;
};

/// The answer to one command, as sent.
struct Receipt {
  std::int64_t client = 0;
  std::int64_t sequence = 0;
  Tick tick = 0;
  Outcome outcome;
  friend bool operator==(const Receipt&, const Receipt&) = default;
};

}  // namespace cradle
