// Names of worlds and channels.
#include "protocol/channels.h"

#include <cradle/limits.h>

#include <catch2/catch.hpp>
#include <set>

namespace cradle {

TEST_CASE("every kind of message has a channel of its own, and is found by it") {
  const Channels channels("arena");
  std::set<std::string> names;
  for (int k = 0; k < kMessageKinds; ++k) {
    const auto kind = static_cast<MessageKind>(k);
    names.insert(channels.name(kind));
    CHECK(channels.kind(channels.name(kind)) == kind);
  }
  CHECK(names.size() == kMessageKinds);
  // As the comments of lcmtypes/*.lcm name them.
  CHECK(channels.name(MessageKind::push) == "CRADLE_arena_WRENCH");
  CHECK(channels.name(MessageKind::clear_wrenches) == "CRADLE_arena_CLEAR");
  CHECK(channels.name(MessageKind::states) == "CRADLE_arena_STATES");
}

TEST_CASE("other worlds, other spellings and other programs are no channels of a world") {
  const Channels channels("arena");
  for (const char* other : {"", "CRADLE_arena_", "CRADLE_arena_spawn", "CRADLE_arena2_SPAWN",
                            "CRADLE_arena_SPAWN2", "xCRADLE_arena_SPAWN", "LCM_SELF_TEST"}) {
    CAPTURE(other);
    CHECK(!channels.kind(other));
  }
}

TEST_CASE("a world's name has 1 to 24 letters, digits, dashes and underscores") {
  for (const char* good : {"a", "Z9", "left-hand_2", "abcdefghijklmnopqrstuvwx"}) {
    CAPTURE(good);
    CHECK(is_world_name(good));
  }
  // '.', '*' and '|' would be patterns to LCM.
  for (const char* bad : {"", "abcdefghijklmnopqrstuvwxy", "a b", "a.b", "a*", "a|b", "\xC3\xA9"}) {
    CAPTURE(bad);
    CHECK(!is_world_name(bad));
  }
  CHECK(!is_world_name(std::string_view("a\0b", 3)));
}

TEST_CASE("the longest world's channels are names that LCM takes") {
  const Channels channels(std::string(limits::kWorldNameBytes, 'w'));
  for (int k = 0; k < kMessageKinds; ++k) {
    CHECK(channels.name(static_cast<MessageKind>(k)).size() <= 63);  // LCM_MAX_CHANNEL_NAME_LENGTH
  }
}

}  // namespace cradle
