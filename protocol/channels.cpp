#include "protocol/channels.h"

#include <cradle/limits.h>

#include <algorithm>

namespace cradle {
namespace {
constexpr std::array<const char*, kMessageKinds> kSuffixes = {
    "HELLO",   "SPAWN",   "DESPAWN",  "WRENCH", "CLEAR",  "MOTION",
    "GRAVITY", "CONTROL", "RECEIPTS", "STATUS", "STATES", "EVENTS"};
}  // namespace

Channels::Channels(std::string_view world) {
  for (std::size_t i = 0; i < names_.size(); ++i) {
    names_[i] = "CRADLE_" + std::string(world) + "_" + kSuffixes[i];
  }
}

std::optional<MessageKind> Channels::kind(std::string_view channel) const {
  const auto found = std::find(names_.begin(), names_.end(), channel);
  if (found == names_.end()) return std::nullopt;
  return static_cast<MessageKind>(found - names_.begin());
}

bool is_world_name(std::string_view world) {
  const auto is_allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_';
  };
  return !world.empty() && world.size() <= limits::kWorldNameBytes &&
         std::all_of(world.begin(), world.end(), is_allowed);
}

}  // namespace cradle
