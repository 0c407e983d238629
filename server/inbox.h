/// Between the network and the tick: a bounded queue of commands as they came.
///
/// The receive thread puts, the tick drains: nothing is done directly in reaction to a packet.
#pragma once

#include <cstdint>
#include <mutex>
#include <vector>

#include "protocol/codec.h"

namespace cradle {

struct RawCommand {
  MessageKind kind = MessageKind::hello;
  Bytes payload;
};

class Inbox {
 public:
  Inbox();
  ~Inbox();
  Inbox(const Inbox&) = delete;
  Inbox& operator=(const Inbox&) = delete;

  struct Contents {
    std::vector<RawCommand> commands;  ///< in the order of arrival
    std::int64_t bytes = 0;            ///< of their payloads
    std::vector<CommandHeader>
        overflow;  ///< of commands that found the inbox full: to be told `busy`
  };

  /// Copies the payload. A payload of the wrong size is counted and dropped here already. Any
  /// thread.
  void put(MessageKind kind, ByteView payload);

  /// All that has come since the last call.
  Contents drain();

  /// What was kept out, since the start.
  struct Counters {
    std::int64_t no_count = 0, bad_count = 0, wrong_size = 0;  ///< see SizeCheck
    std::int64_t dropped = 0;  ///< found the inbox full, and could not even be told so
    std::int64_t rejected() const { return no_count + bad_count + wrong_size; }
  };
  Counters counters() const;

  /// Becomes readable when something waits; drain() resets it.
  int file_descriptor() const { return event_; }

 private:
  mutable std::mutex mutex_;
  Contents contents_;
  Counters counters_;
  int event_ = -1;
};

}  // namespace cradle
