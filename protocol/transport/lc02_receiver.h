/// Receives LCM's short messages (magic LC02) from a multicast group, and nothing else.
///
/// Why not liblcm: two crafted datagrams crash any subscriber of liblcm 1.3.1, it hears every
/// group on its port and remote unicast too, and it hides what the kernel dropped. This receiver is
/// bound to the group, takes whole short messages only, and counts the rest.
///
/// Format, big endian: u32 0x4c433032, u32 sender's counter, channel name (at most 63 bytes) and a
/// zero byte, payload. Cost: about 2 us a datagram, one system call for up to 32.
#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include "protocol/transport/lcm_url.h"
#include "protocol/transport/transport.h"

namespace cradle {

/// One datagram, taken apart.
struct Lc02Message {
  std::string_view channel;
  ByteView payload;
};
/// Nothing unless it is a whole short message; then `fault`, if given, says why.
std::optional<Lc02Message> parse_lc02(ByteView datagram, DatagramFault* fault = nullptr);

class Lc02Receiver {
 public:
  /// Joins the group on the interface that the route to it gives.
  /// Throws std::system_error where the host refuses.
  explicit Lc02Receiver(const LcmUrl& url);
  ~Lc02Receiver();
  Lc02Receiver(const Lc02Receiver&) = delete;
  Lc02Receiver& operator=(const Lc02Receiver&) = delete;

  /// As Transport::receive; takes at most kBatches batches a call, so that a flood cannot hold it.
  int receive(std::chrono::microseconds timeout, const Transport::Sink& sink);

  /// Counters received, rejected, dropped_by_kernel and the buffer's size.
  const TransportStats& stats() const { return stats_; }

  int file_descriptor() const { return socket_; }

 private:
  struct Buffers;

  int socket_ = -1;
  std::unique_ptr<Buffers> buffers_;
  TransportStats stats_;
};

}  // namespace cradle
