/// `udpm://239.255.76.67:7667?ttl=0`: where a world is on the network.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace cradle {

struct LcmUrl {
  std::string group = "239.255.76.67";
  int port = 7667;
  int ttl = 0;  ///< 0: this host only

  std::string text() const;
  /// The port of body states, beside the one of commands, receipts, status and events.
  LcmUrl state_lane() const { return {group, port + 1, ttl}; }
};

/// The largest datagram to send there: what fits LCM's short message on this host, else an Ethernet
/// frame.
int default_datagram_bytes(const LcmUrl& url);

/// Nothing if `text` is not udpm with a multicast IPv4 group, a port of 1024 .. 65534 and at most
/// the option ttl (0 or 1 .. 255). Empty text is the default.
std::optional<LcmUrl> parse_lcm_url(std::string_view text);

}  // namespace cradle
