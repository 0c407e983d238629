#include "server/commands.h"

#include <cradle/limits.h>

#include "protocol/validate.h"

namespace cradle {
namespace {

class Applier {
 public:
  Applier(const CommandHeader& header, World& world, RunState& run, const Permissions& permissions)
      : header_(header), world_(world), run_(run), permissions_(permissions) {}

  Outcome operator()(const Hello&) const { return {}; }
  Outcome operator()(const Spawn& c) const { return world_.spawn(c.bodies); }
  Outcome operator()(const Despawn& c) const { return world_.despawn(c.bodies); }
  Outcome operator()(const Push& c) const { return world_.push(c.wrenches); }
  Outcome operator()(const ClearWrenches& c) const { return world_.clear_wrenches(c.bodies); }
  Outcome operator()(const SetMotion& c) const { return world_.set_motion(c.motions); }
  Outcome operator()(const SetGravity& c) const { return world_.set_gravity(c.gravity_W); }

  Outcome operator()(const Control& c) const {
    const bool is_allowed =
        c.action == ControlAction::shutdown ? permissions_.shutdown : permissions_.control;
    if (!is_allowed) return {Result::not_allowed, {}, 0};
    switch (c.action) {
      case ControlAction::pause:
        run_.paused = true;
        return {};
      case ControlAction::resume:
        run_.paused = false;
        return {};
      case ControlAction::shutdown:
        run_.shutdown = true;
        return {};
      case ControlAction::step:
        break;
    }
    return step(c.steps);
  }

 private:
  /// Steps are for a world that stands still; each command's come after those before it.
  Outcome step(std::int64_t steps) const {
    if (!run_.paused && !run_.lockstep) return {Result::not_allowed, {}, 0};
    if (run_.pending.size() >= static_cast<std::size_t>(limits::kQueuedCommands)) {
      return {Result::over_quota, {}, 0};
    }
    const Tick begin = run_.pending.empty() ? world_.tick() : run_.pending.back().until;
    run_.pending.push_back({header_, begin + steps});
    return {Result::queued, {}, 0};
  }

  const CommandHeader& header_;
  World& world_;
  RunState& run_;
  const Permissions& permissions_;
};

}  // namespace

Outcome apply(const Command& command, World& world, RunState& run, const Permissions& permissions) {
  const Outcome fault = validate(command.body);
  if (fault.result != Result::ok) return fault;
  return std::visit(Applier(command.header, world, run, permissions), command.body);
}

}  // namespace cradle
