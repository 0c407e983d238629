#include "server/publisher.h"

#include <cradle/limits.h>

#include <algorithm>
#include <chrono>
#include <span>

namespace cradle {
namespace {

// A default receive buffer of 208 KiB loses nothing at 60 datagrams of 1.4 kB in 2 ms, or two of
// 60 kB in 1 ms (measured with LCM 1.3.1 on loopback).
constexpr int kSmallDatagramBytes = 4096;
constexpr int kSmallBurst = 30;
constexpr int kLargeBurst = 2;
constexpr std::chrono::milliseconds kBurstPause{1};

}  // namespace

std::vector<StateChunk> chunks_of(const Snapshot& snapshot, int per_chunk) {
  const auto size = static_cast<std::size_t>(per_chunk);
  const std::size_t count = std::max<std::size_t>(1, (snapshot.states.size() + size - 1) / size);
  std::vector<StateChunk> chunks(count);
  std::int64_t covered = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t begin = k * size;
    const std::size_t end = std::min(begin + size, snapshot.states.size());
    StateChunk& chunk = chunks[k];
    chunk.epoch = snapshot.epoch;
    chunk.tick = snapshot.tick;
    chunk.tick_time_us = snapshot.tick_time_us;
    chunk.sent_us = snapshot.sent_us;
    chunk.chunk = static_cast<std::int32_t>(k);
    chunk.chunks = static_cast<std::int32_t>(count);
    chunk.states.assign(snapshot.states.begin() + static_cast<std::ptrdiff_t>(begin),
                        snapshot.states.begin() + static_cast<std::ptrdiff_t>(end));
    chunk.first_body = {covered + 1};
    covered = k + 1 == count ? limits::kIntegerMax : chunk.states.back().body.value;
    chunk.last_body = {covered};
  }
  return chunks;
}

Publisher::Publisher(Transport& transport, Channels channels, int datagram_bytes,
                     std::chrono::microseconds period)
    : transport_(transport),
      channels_(std::move(channels)),
      per_chunk_(items_per_datagram(MessageKind::states, datagram_bytes)),
      period_(period),
      thread_([this] { run(); }) {}

Publisher::~Publisher() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void Publisher::publish(Snapshot& snapshot) {
  {
    const std::lock_guard lock(mutex_);
    if (has_waiting_) {
      const auto size = static_cast<std::int64_t>(waiting_.states.size());
      dropped_ += std::max<std::int64_t>(1, (size + per_chunk_ - 1) / per_chunk_);
    }
    std::swap(waiting_, snapshot);
    has_waiting_ = true;
  }
  changed_.notify_all();
}

void Publisher::flush() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !has_waiting_ && !is_sending_; });
}

std::int64_t Publisher::chunks_dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

void Publisher::run() {
  Snapshot snapshot;
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return has_waiting_ || is_ending_; });
    if (is_ending_) return;
    std::swap(snapshot, waiting_);
    has_waiting_ = false;
    is_sending_ = true;
    lock.unlock();
    send(snapshot);
    lock.lock();
    is_sending_ = false;
    changed_.notify_all();
  }
}

void Publisher::send(const Snapshot& snapshot) {
  const std::vector<StateChunk> chunks = chunks_of(snapshot, per_chunk_);
  // The pauses must fit the tick; where they do not, bursts grow beyond what is safe everywhere.
  const auto pauses = std::max<std::int64_t>(1, period_ * 6 / 10 / kBurstPause);
  const auto needed = (static_cast<std::int64_t>(chunks.size()) + pauses - 1) / pauses;
  std::int64_t burst = 0;
  for (const StateChunk& chunk : chunks) {
    if (is_ending_) return;
    const Bytes bytes = encode(chunk);
    const int safe = bytes.size() <= kSmallDatagramBytes ? kSmallBurst : kLargeBurst;
    if (burst >= std::max<std::int64_t>(safe, needed)) {
      std::this_thread::sleep_for(kBurstPause);
      burst = 0;
    }
    ++burst;
    transport_.send(channels_.name(MessageKind::states), bytes);
  }
}

}  // namespace cradle
