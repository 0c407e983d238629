/// Where the fields of each message are, counted by hand from lcmtypes/*.lcm and LCM's documented
/// encoding: a fingerprint of 8 bytes, then the fields in their order, big endian, unpadded; a
/// nested struct without a fingerprint of its own (LCM, "Type specification: encoding").
#pragma once

#include "protocol/channels.h"

namespace cradle::test {

inline constexpr std::size_t kFingerprintBytes = 8;
inline constexpr std::size_t kCountAt = 8;
inline constexpr std::size_t kHeaderBytes = 4 * 8;
inline constexpr std::size_t kNameBytes = 32;

/// A message of n items has fixed + n * item bytes; item is 0 where there are none.
struct Layout {
  std::size_t fixed;
  std::size_t item;
};

inline constexpr Layout layout_of(MessageKind kind) {
  constexpr std::size_t kCommand = kFingerprintBytes + kHeaderBytes;
  constexpr std::size_t kList = kCommand + 4;
  constexpr std::size_t kMotion = (3 + 4 + 3 + 3) * 8;  // p, q, v, w
  switch (kind) {
    case MessageKind::hello:
      return {kCommand + 4 + kNameBytes, 0};
    case MessageKind::spawn:
      return {kList, 5 * 4 + (8 + 2 + 3 + 3 + 3 + 4 + 1) * 8 + kMotion + kNameBytes};
    case MessageKind::despawn:
    case MessageKind::clear_wrenches:
      return {kList, 8};
    case MessageKind::push:
      return {kList, 8 + 4 * 4 + 8 + 6 * 8};
    case MessageKind::set_motion:
      return {kList, 2 * 8 + kMotion};
    case MessageKind::set_gravity:
      return {kCommand + 3 * 8, 0};
    case MessageKind::control:
      return {kCommand + 4 + 8, 0};
    case MessageKind::receipts:
      return {kFingerprintBytes + 4 + 8, 4 * 8 + 2 * 4};
    case MessageKind::status:
      return {kFingerprintBytes + 2 * 4 + 3 * 8 + 2 * 8 + 4 * 8 + 4 * 8 + 2 * 8 + (8 + 4 + 8) +
                  (5 + 1 + 8) * 8 + 4 + 7 * 8 + 3 * 4 + kNameBytes,
              0};
    case MessageKind::states:
      return {kFingerprintBytes + 4 + 4 * 8 + 2 * 4 + 2 * 8, 8 + 2 * 4 + kMotion};
    case MessageKind::events:
      break;
  }
  return {kFingerprintBytes + 4 + 2 * 8, 3 * 8 + 4 * 4 + (8 + 1 + 3) * 8 + kNameBytes};
}

}  // namespace cradle::test
