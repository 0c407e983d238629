/// How datagrams get from process to process: one interface, several kinds.
#pragma once

#include <cradle/result.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <numeric>
#include <string>
#include <string_view>

#include "protocol/codec.h"

namespace cradle {

/// Why a datagram is not a whole, short LCM message.
enum class DatagramFault {
  too_short,    ///< for LCM's header
  bad_magic,    ///< not LCM's
  fragment,     ///< a part of a message of LCM's that needs several datagrams: never used here
  bad_channel,  ///< its name does not end within 63 bytes
  too_long,     ///< for the receiver's buffer
};
inline constexpr int kDatagramFaults = 5;

/// Counted since the transport was opened; nothing is lost in silence.
struct TransportStats {
  std::int64_t sent = 0;
  std::int64_t sent_bytes = 0;  ///< of payloads
  std::int64_t send_failures = 0;
  std::int64_t received = 0;
  std::array<std::int64_t, kDatagramFaults> faults{};  ///< by DatagramFault
  std::int64_t dropped_by_kernel = 0;                  ///< the receive buffer was full
  int receive_buffer_bytes = 0;                        ///< granted; 0 where there is none

  void count(DatagramFault fault, std::int64_t times = 1) {
    faults[static_cast<std::size_t>(fault)] += times;
  }
  std::int64_t rejected() const {
    return std::accumulate(faults.begin(), faults.end(), std::int64_t{0});
  }
};

/// One port that carries named messages to everybody who listens there, the sender included.
/// Unreliable: messages may get lost, doubled or change order. Sending and receiving may happen in
/// two threads at once, each in one thread at a time.
class Transport {
 public:
  /// Payload and channel are valid during the call only. Must not throw.
  using Sink = std::function<void(std::string_view channel, ByteView payload)>;

  virtual ~Transport() = default;

  /// False if it was not sent; that is counted too.
  virtual bool send(std::string_view channel, ByteView payload) = 0;

  /// Hands on all waiting messages, waiting up to `timeout` for the first; how many there were.
  /// Reports 0 at once on a transport that only sends.
  virtual int receive(std::chrono::microseconds timeout, const Sink& sink) = 0;

  virtual TransportStats stats() const = 0;

  /// Readable when messages wait, for ::poll on several at once; -1 where there is none.
  virtual int file_descriptor() const { return -1; }
};

/// A transport, or why there is none.
struct OpenedTransport {
  std::unique_ptr<Transport> transport;
  Result result = Result::ok;
  std::string message;  ///< one line for the operator if there is none: what failed, what to type
};

}  // namespace cradle
