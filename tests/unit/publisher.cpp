// Snapshots cut into chunks that stand alone, and sent from a thread of their own.
#include "server/publisher.h"

#include <cradle/limits.h>

#include <catch2/catch.hpp>
#include <future>
#include <thread>

namespace cradle {
namespace {

constexpr std::chrono::microseconds kPeriod{16'667};

Snapshot snapshot_of(std::size_t bodies, Tick tick = 5) {
  Snapshot s{9, tick, 83'333, 123, {}};
  for (std::size_t i = 0; i < bodies; ++i) {
    BodyState state;
    state.body = {3 + 7 * static_cast<std::int64_t>(i)};  // with gaps, as after removals
    state.p_WBo.x = static_cast<double>(i);
    s.states.push_back(state);
  }
  return s;
}

/// A transport that keeps what is sent, and holds the sender back until it is opened.
class Gate final : public Transport {
 public:
  bool send(std::string_view channel, ByteView payload) override {
    std::unique_lock lock(mutex_);
    is_entered_ = true;
    changed_.notify_all();
    changed_.wait(lock, [this] { return is_open_; });
    channels.emplace_back(channel);
    sizes.push_back(payload.size());
    auto chunk = decode_states(payload);
    chunks.push_back(chunk ? *chunk : StateChunk{});
    return true;
  }
  int receive(std::chrono::microseconds, const Sink&) override { return 0; }
  TransportStats stats() const override { return {}; }

  void wait_for_sender() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return is_entered_; });
  }
  void open() {
    const std::lock_guard lock(mutex_);
    is_open_ = true;
    changed_.notify_all();
  }

  // To be read after Publisher::flush().
  std::vector<std::string> channels;
  std::vector<std::size_t> sizes;
  std::vector<StateChunk> chunks;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_entered_ = false;
  bool is_open_ = false;
};

std::vector<Tick> ticks_of(const Gate& gate) {
  std::vector<Tick> ticks;
  for (const StateChunk& chunk : gate.chunks) ticks.push_back(chunk.tick);
  return ticks;
}

}  // namespace

TEST_CASE("chunks cover all ids without a gap, hold every body once, and stand alone") {
  constexpr int kPerChunk = 4;
  for (const std::size_t bodies : {1u, 3u, 4u, 5u, 8u, 9u, 40u}) {
    CAPTURE(bodies);
    const Snapshot snapshot = snapshot_of(bodies);
    const auto chunks = chunks_of(snapshot, kPerChunk);
    REQUIRE(chunks.size() == (bodies + kPerChunk - 1) / kPerChunk);
    std::vector<BodyState> all;
    std::int64_t next_id = 1;
    for (std::size_t k = 0; k < chunks.size(); ++k) {
      const StateChunk& chunk = chunks[k];
      CHECK(chunk.first_body.value == next_id);
      next_id = chunk.last_body.value + 1;
      CHECK(chunk.states.size() <= kPerChunk);
      CHECK(std::all_of(chunk.states.begin(), chunk.states.end(), [&](const BodyState& s) {
        return s.body >= chunk.first_body && s.body <= chunk.last_body;
      }));
      all.insert(all.end(), chunk.states.begin(), chunk.states.end());
      CHECK(chunk.chunk == static_cast<int>(k));
      CHECK(chunk.chunks == static_cast<int>(chunks.size()));
      CHECK(chunk.epoch == 9);
      CHECK(chunk.tick == 5);
      CHECK(chunk.tick_time_us == 83'333);
      CHECK(chunk.sent_us == 123);
      CHECK(decode_states(encode(chunk)) == chunk);
    }
    CHECK(next_id == limits::kIntegerMax + 1);
    CHECK(all == snapshot.states);
  }
}

TEST_CASE("a world without bodies is told by one empty chunk of all ids") {
  const auto chunks = chunks_of(snapshot_of(0), 4);
  REQUIRE(chunks.size() == 1);
  CHECK(chunks[0].first_body.value == 1);
  CHECK(chunks[0].last_body.value == limits::kIntegerMax);
  CHECK(chunks[0].chunks == 1);
  CHECK(chunks[0].states.empty());
  CHECK(decode_states(encode(chunks[0])) == chunks[0]);
}

TEST_CASE("no datagram exceeds the limit, and the chunks are as full as it allows") {
  for (const int limit : {limits::kNetworkDatagramBytes, limits::kLoopbackDatagramBytes}) {
    Gate gate;
    gate.open();
    Publisher publisher(gate, Channels("w"), limit, kPeriod);
    Snapshot snapshot = snapshot_of(1000);
    publisher.publish(snapshot);
    publisher.flush();
    // 64: the longest channel with its zero; the trailer is not sent yet, but has its room.
    const std::size_t room = static_cast<std::size_t>(limit) - 64 - limits::kTrailerBytes;
    constexpr std::size_t kBodyBytes = 120;  // body_state_v1.lcm
    std::size_t bodies = 0;
    for (std::size_t k = 0; k < gate.chunks.size(); ++k) {
      CHECK(gate.sizes[k] <= room);
      if (k + 1 < gate.chunks.size()) CHECK(gate.sizes[k] + kBodyBytes > room);
      CHECK(gate.channels[k] == "CRADLE_w_STATES");
      bodies += gate.chunks[k].states.size();
    }
    CHECK(bodies == 1000);
    CHECK(publisher.chunks_dropped() == 0);
  }
}

TEST_CASE("a snapshot that waits is replaced by the next, and its chunks are counted") {
  Gate gate;
  Publisher publisher(gate, Channels("w"), 1400, kPeriod);
  const int per_chunk = items_per_datagram(MessageKind::states, 1400);
  const auto publish = [&](std::size_t bodies, Tick tick) {
    Snapshot snapshot = snapshot_of(bodies, tick);
    publisher.publish(snapshot);
  };
  publish(1, 1);
  gate.wait_for_sender();  // tick 1 is on its way
  publish(static_cast<std::size_t>(2 * per_chunk + 1), 2);
  CHECK(publisher.chunks_dropped() == 0);
  publish(static_cast<std::size_t>(per_chunk), 3);
  CHECK(publisher.chunks_dropped() == 3);
  publish(0, 4);
  CHECK(publisher.chunks_dropped() == 4);
  publish(1, 5);
  CHECK(publisher.chunks_dropped() == 5);  // an empty snapshot is one chunk too
  gate.open();
  publisher.flush();
  CHECK(ticks_of(gate) == std::vector<Tick>{1, 5});
}

TEST_CASE("a flush returns when all is sent, not before") {
  Gate gate;
  Publisher publisher(gate, Channels("w"), 1400, kPeriod);
  publisher.flush();  // nothing to wait for
  Snapshot snapshot = snapshot_of(30);
  publisher.publish(snapshot);
  gate.wait_for_sender();
  std::atomic<bool> is_open = false;
  auto flushed = std::async(std::launch::async, [&] {
    publisher.flush();
    return is_open.load();
  });
  is_open = true;
  gate.open();
  CHECK(flushed.get());
  CHECK(gate.chunks.size() == static_cast<std::size_t>(gate.chunks.at(0).chunks));
}

TEST_CASE("a publisher that ends sends nothing but the chunk that is on its way") {
  Gate gate;
  std::future<void> opened;
  {
    Publisher publisher(gate, Channels("w"), 1400, kPeriod);
    Snapshot first = snapshot_of(1000, 1), second = snapshot_of(1, 2);
    publisher.publish(first);
    gate.wait_for_sender();
    publisher.publish(second);
    opened = std::async(std::launch::async, [&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(200));  // the end begins meanwhile
      gate.open();
    });
  }
  opened.get();
  CHECK(ticks_of(gate) == std::vector<Tick>{1});
}

TEST_CASE("publishing gives an old buffer back, so that ticks need not allocate") {
  Gate gate;
  gate.open();
  Publisher publisher(gate, Channels("w"), 1400, kPeriod);
  Snapshot snapshot;
  // Three buffers go round: the caller's, the waiting one and the one being sent.
  for (int round = 0; round < 3; ++round) {
    snapshot.states.resize(100);
    publisher.publish(snapshot);
    publisher.flush();
  }
  CHECK(snapshot.states.capacity() >= 100);
}

}  // namespace cradle
