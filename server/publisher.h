/// Sends snapshots as self-contained chunks, from a thread of its own: the kernel copies each
/// datagram to every local receiver inside the send, and a burst overflows their buffers, so
/// chunks are paced.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "protocol/channels.h"
#include "protocol/transport/transport.h"

namespace cradle {

/// A tick's states, to be cut into chunks.
struct Snapshot {
  std::int64_t epoch = 0;
  Tick tick = 0;
  std::int64_t tick_time_us = 0;
  std::int64_t sent_us = 0;
  std::vector<BodyState> states;  ///< in ascending order of ids
};

/// The chunks of a snapshot, each at most `per_chunk` bodies; one empty chunk if there are none.
/// Their ranges cover all ids without gap.
std::vector<StateChunk> chunks_of(const Snapshot& snapshot, int per_chunk);

class Publisher {
 public:
  /// `datagram_bytes` bounds each datagram; the chunks of a tick are spread over most of its
  /// `period`. The transport must outlive the publisher.
  Publisher(Transport& transport, Channels channels, int datagram_bytes,
            std::chrono::microseconds period);
  /// Sends nothing more but the chunk that is on its way.
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  /// Swaps in the next snapshot and returns at once; `snapshot` gets an old buffer back. One that
  /// is still waiting is replaced, and its chunks are counted as dropped.
  void publish(Snapshot& snapshot);

  /// Waits until everything handed over is sent.
  void flush();

  std::int64_t chunks_dropped() const;

 private:
  void run();
  void send(const Snapshot& snapshot);

  Transport& transport_;
  const Channels channels_;
  const int per_chunk_;
  const std::chrono::microseconds period_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Snapshot waiting_;
  bool has_waiting_ = false;
  bool is_sending_ = false;
  std::atomic<bool> is_ending_ = false;
  std::int64_t dropped_ = 0;
  std::thread thread_;  // last: it uses the others
};

}  // namespace cradle
