/// Versions of the library and of the protocol.
#pragma once

#define CRADLE_VERSION "0.1.0"

namespace cradle {

/// Two programs talk only if theirs are equal; raised whenever a message type changes.
inline constexpr int kProtocolVersion = 2;

}  // namespace cradle
