/// Which message travels on which channel.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace cradle {

enum class MessageKind : int {
  hello,
  spawn,
  despawn,
  push,
  clear_wrenches,
  set_motion,
  set_gravity,
  control,  // commands
  receipts,
  status,
  states,
  events,  // of the server
};
inline constexpr int kMessageKinds = 12;
constexpr bool is_command(MessageKind kind) { return kind <= MessageKind::control; }

/// The channel names of one world, `CRADLE_<world>_<KIND>`.
class Channels {
 public:
  /// `world` must satisfy is_world_name().
  explicit Channels(std::string_view world);

  const std::string& name(MessageKind kind) const { return names_[static_cast<std::size_t>(kind)]; }
  std::optional<MessageKind> kind(std::string_view channel) const;

 private:
  std::array<std::string, kMessageKinds> names_;
};

/// 1 .. limits::kWorldNameBytes letters, digits, '-' and '_': LCM reads channels as patterns.
bool is_world_name(std::string_view world);

}  // namespace cradle
