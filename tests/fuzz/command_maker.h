/// Makes commands from a fuzzer's bytes: mostly such as a client would send, with numbers at and
/// beyond their limits, ids and sequences of others, and targets before and after their time.
#pragma once

#include <cradle/limits.h>
#include <cradle/version.h>

#include <map>

#include "tests/fuzz/value_maker.h"

namespace cradle::fuzz {

class CommandMaker : ValueMaker {
 public:
  static constexpr std::int64_t kEpoch = 77;

  explicit CommandMaker(Input& input) : ValueMaker(input, false) {}

  Command command(Tick coming_tick) {
    CommandHeader header;
    header.client = 1 + static_cast<std::int64_t>(in_.below(4));
    std::int64_t& next = next_[header.client];
    const bool is_first = next == 0;
    header.sequence = sequence(next);
    header.epoch = in_.one_in(32) ? in_.any<std::uint8_t>() : kEpoch;
    header.target_tick = target(coming_tick);
    const bool is_hello = is_first && !in_.one_in(16);
    if (is_hello) header.epoch = 0;
    return {header, is_hello ? CommandBody{Hello{kProtocolVersion, "fuzzer"}} : body()};
  }

 private:
  std::int64_t sequence(std::int64_t& next) {
    switch (in_.below(16)) {
      case 0:  // said already
        return 1 + static_cast<std::int64_t>(in_.below(static_cast<std::size_t>(next % 255) + 1));
      case 1:  // leaves a gap, which the next one may fill
        return next + 2;
      case 2:
        return 1 + next + 4 * static_cast<std::int64_t>(in_.any<std::uint8_t>());
      case 3:
        return integer();
      default:
        return ++next;
    }
  }

  Tick target(Tick coming) {
    switch (in_.below(16)) {
      case 0:
        return coming;
      case 1:
        return coming + static_cast<Tick>(in_.below(8));
      case 2:
        return 1;
      case 3:
        return coming + limits::kTicksAhead + static_cast<Tick>(in_.below(2));
      case 4:
        return integer();
      default:
        return 0;
    }
  }

  CommandBody body() {
    const auto id = [this] { return body_id(); };
    switch (in_.below(12)) {
      case 0:
        return Hello{in_.one_in(8) ? in_.any<std::int32_t>() : kProtocolVersion, name()};
      case 1:
      case 2:
      case 3:
        return Spawn{list([this] { return spec(); })};
      case 4:
        return Despawn{list(id)};
      case 5:
      case 6:
        return Push{list([this] { return wrench(); })};
      case 7:
        return ClearWrenches{list(id)};
      case 8:
      case 9:
        return SetMotion{list([this] { return motion(); })};
      case 10:
        return SetGravity{vector()};
      default:
        return control();
    }
  }

  template <class Make>
  std::vector<std::invoke_result_t<Make>> list(Make make) {
    std::vector<std::invoke_result_t<Make>> items;
    const std::size_t count = in_.one_in(16) ? in_.below(20) : 1 + in_.below(3);
    while (items.size() < count) items.push_back(make());
    return items;
  }

  Control control() {
    Control c{one_of(ControlAction::shutdown), 0};
    if (c.action == ControlAction::step) c.steps = in_.one_in(8) ? integer() : 3;
    return c;
  }

  std::map<std::int64_t, std::int64_t> next_;  ///< last sequence given out, by client
};

}  // namespace cradle::fuzz
