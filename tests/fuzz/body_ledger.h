/// What a world's bodies must be after its commands, told a second time: none lost, none confused
/// with another, none with numbers that are none.
#pragma once

#include <cradle/limits.h>

#include <cmath>
#include <map>
#include <set>
#include <variant>
#include <vector>

#include "server/world/world.h"
#include "tests/fuzz/input.h"

namespace cradle::fuzz {

class BodyLedger {
 public:
  /// A command took effect.
  void note(const World& world, const CommandBody& command, const Outcome& outcome) {
    if (const auto* spawn = std::get_if<Spawn>(&command)) note_spawn(*spawn, outcome.body);
    if (const auto* despawn = std::get_if<Despawn>(&command)) {
      for (const BodyId body : despawn->bodies) bodies_.erase(body.value);
    }
    if (const auto* set = std::get_if<SetMotion>(&command)) note_motions(world, *set);
  }

  /// A command was refused: not for a name that is free, nor for a body that is there.
  void check_refusal(const CommandBody& command, const Outcome& outcome) const {
    const auto item = static_cast<std::size_t>(outcome.item);
    if (outcome.result == Result::duplicate_name) {
      const std::string& name = std::get<Spawn>(command).bodies.at(item).name;
      require(is_taken(name, std::get<Spawn>(command), item),
              "a name is refused while it is taken");
    }
    if (outcome.result == Result::unknown_body) {
      require(!bodies_.contains(body_of(command, item).value), "a body that is there is known");
    }
  }

  /// After every command and every step.
  void check(const World& world) {
    require(world.body_count() == static_cast<std::int64_t>(bodies_.size()),
            "as many bodies as were made and not removed");
    require(world.wrench_count() <= world.settings().wrenches_max, "no more wrenches than allowed");
    check_what_they_are(world);
    check_where_they_are(world);
  }

  /// Sum of all angular speeds, at the last check.
  double turning_radps() const {
    double sum = 0;
    for (const BodyState& s : states_) {
      sum += std::abs(s.w_WB.x) + std::abs(s.w_WB.y) + std::abs(s.w_WB.z);
    }
    return sum;
  }

  /// The world's news since the last call, after its check.
  void check_events(World& world) {
    for (const Event& event : world.take_events()) {
      if (event.kind == EventKind::spawned)
        require(told_.insert(event.body.value).second, "told once");
      if (event.kind == EventKind::removed)
        require(told_.erase(event.body.value) == 1, "told once");
      if (event.kind == EventKind::quarantined) ++quarantined_told_;
    }
    require(told_.size() == bodies_.size(), "every body made or removed is told");
    require(quarantined_told_ == world.quarantined_count(), "every quarantine is told");
  }

 private:
  struct Body {
    BodySpec spec;
    Vec3 p_WBo;  ///< of a fixed body, for good
  };

  bool is_taken(const std::string& name, const Spawn& spawn, std::size_t item) const {
    const auto has_name = [&](const BodySpec& spec) { return spec.name == name; };
    return std::any_of(spawn.bodies.begin(), spawn.bodies.begin() + static_cast<long>(item),
                       has_name) ||
           std::any_of(bodies_.begin(), bodies_.end(),
                       [&](const auto& entry) { return has_name(entry.second.spec); });
  }

  static BodyId body_of(const CommandBody& command, std::size_t item) {
    if (const auto* c = std::get_if<Despawn>(&command)) return c->bodies.at(item);
    if (const auto* c = std::get_if<ClearWrenches>(&command)) return c->bodies.at(item);
    if (const auto* c = std::get_if<Push>(&command)) return c->wrenches.at(item).body;
    return std::get<SetMotion>(command).motions.at(item).body;
  }

  void note_spawn(const Spawn& spawn, BodyId first) {
    require(first.value > last_id_, "ids grow, and are never used again");
    last_id_ = first.value - 1;
    for (const BodySpec& spec : spawn.bodies) bodies_[++last_id_] = {spec, spec.p_WBo};
  }

  void note_motions(const World& world, const SetMotion& set) {
    std::map<std::int64_t, Motion> last;
    for (const Motion& motion : set.motions) {
      if (motion.sets_pose) last[motion.body.value] = motion;
    }
    for (const auto& [id, motion] : last) {
      BodyState state;
      require(world.find({id}, state), "the body named is there");
      const bool is_offset = has_offset(bodies_.at(id).spec);
      require(is_offset ? is_near(state.p_WBo, motion.p_WBo) : state.p_WBo == motion.p_WBo,
              "the body named is moved");
      bodies_.at(id).p_WBo = motion.p_WBo;
    }
  }

  void check_what_they_are(const World& world) const {
    const auto described = world.describe({}, static_cast<int>(bodies_.size()) + 1);
    require(described.size() == bodies_.size(), "every body is described");
    auto expected = bodies_.begin();
    for (const Event& body : described) {
      const auto& [id, known] = *expected++;
      require(body.body.value == id && body.body_kind == known.spec.kind &&
                  body.shape == known.spec.shape && body.name == known.spec.name,
              "a body stays what it was made");
      require((body.mass_kg > 0) == (known.spec.kind == BodyKind::dynamic), "dynamic bodies yield");
    }
  }

  void check_where_they_are(const World& world) {
    world.snapshot(states_);
    require(states_.size() == bodies_.size(), "every body has a state");
    auto expected = bodies_.begin();
    for (const BodyState& s : states_) {
      const auto& [id, known] = *expected++;
      require(s.body.value == id && s.kind == known.spec.kind, "states come in the order of ids");
      if (s.kind == BodyKind::fixed) require(s.p_WBo == known.p_WBo, "a fixed body stays");
      // The limit holds for the centre of mass; the origin is at most so far from it.
      const double apart = has_offset(known.spec) ? 2 * limits::kSizeMax_m : 0;
      require(is_within(s.p_WBo, limits::kPositionMax_m + apart) &&
                  is_within(s.v_WBcm, limits::kSpeedMax_mps) &&
                  is_within(s.w_WB, limits::kAngularSpeedMax_radps),
              "a state is finite and within its limits, also one in quarantine");
      const Quat& q = s.q_WB;
      const double norm = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
      require(std::abs(norm - 1) < 1e-9, "a rotation is a unit quaternion");
    }
  }

  /// Its centre of mass, which the world moves, may not be its origin.
  static bool has_offset(const BodySpec& spec) {
    return spec.kind == BodyKind::dynamic &&
           (spec.shape.kind == ShapeKind::cone || spec.shape.kind == ShapeKind::polygon ||
            is_stored(spec.shape.kind) || spec.sets_centre_of_mass);
  }
  /// Up to the rounding of an origin and a centre that are kSizeMax_m apart.
  static bool is_near(const Vec3& a, const Vec3& b) {
    constexpr double bound = 1e-7;
    return is_within({a.x - b.x, a.y - b.y, a.z - b.z}, bound);
  }

  static bool is_within(const Vec3& v, double bound) {  // false for what is not a number
    return std::abs(v.x) <= bound && std::abs(v.y) <= bound && std::abs(v.z) <= bound;
  }

  std::map<std::int64_t, Body> bodies_;  ///< by id
  std::int64_t last_id_ = 0;
  std::set<std::int64_t> told_;
  std::int64_t quarantined_told_ = 0;
  std::vector<BodyState> states_;
};

}  // namespace cradle::fuzz
