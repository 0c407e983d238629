#include "protocol/transport/lossy.h"

#include <algorithm>
#include <mutex>
#include <random>
#include <utility>
#include <vector>

namespace cradle {
namespace {

using Clock = std::chrono::steady_clock;

struct DelayedMessage {
  std::string channel;
  Bytes payload;
};

/// One direction: messages go in, and come out fewer, twice, or later.
class Channel {
 public:
  Channel(const Lossiness& lossiness, std::uint64_t direction)
      : lossiness_(lossiness), random_(lossiness.seed * 2 + direction) {}

  template <class Pass>
  void put(DelayedMessage message, const Pass& pass) {
    const int copies = chance(lossiness_.loss) ? 0 : chance(lossiness_.duplication) ? 2 : 1;
    for (int copy = 0; copy < copies; ++copy) {
      const bool is_held_back = chance(lossiness_.reordering);
      if (is_held_back || lossiness_.delay_max.count() > 0) {
        held_.push_back({message, is_held_back ? wait() : 0, Clock::now() + delay()});
      } else {
        pass(message);
      }
    }
    const auto now = Clock::now();
    release(pass, [now](Held& held) { return --held.wait <= 0 && held.due <= now; });
  }

  /// Everything held back whose time has come.
  template <class Pass>
  void flush(const Pass& pass) {
    const auto now = Clock::now();
    release(pass, [now](const Held& held) { return held.due <= now; });
  }

  /// When the first of what is held back is to go on.
  Clock::time_point next_due() const {
    auto first = Clock::time_point::max();
    for (const Held& held : held_) first = std::min(first, held.due);
    return first;
  }

 private:
  struct Held {
    DelayedMessage message;
    int wait = 0;  ///< for that many others
    Clock::time_point due;
  };

  // Own scaling of the engine's numbers: the library's distributions differ from one to another.
  bool chance(double probability) {
    return static_cast<double>(random_() >> 11) * 0x1p-53 < probability;
  }
  int wait() {
    return 1 + static_cast<int>(random_() % static_cast<std::uint64_t>(lossiness_.held_back_max));
  }

  std::chrono::microseconds delay() {
    if (lossiness_.delay_max.count() == 0) return {};
    return std::chrono::microseconds(random_() %
                                     static_cast<std::uint64_t>(lossiness_.delay_max.count()));
  }

  template <class Pass, class IsDue>
  void release(const Pass& pass, const IsDue& is_due) {
    std::vector<Held> waiting = std::exchange(held_, {});
    for (Held& held : waiting) {
      if (is_due(held)) {
        pass(held.message);
      } else {
        held_.push_back(std::move(held));
      }
    }
  }

  Lossiness lossiness_;
  std::mt19937_64 random_;
  std::vector<Held> held_;
};

/// What comes out of the outward channel goes on its way.
struct Sender {
  Transport& transport;
  void operator()(const DelayedMessage& message) const {
    transport.send(message.channel, message.payload);
  }
};

class LossyTransport final : public Transport {
 public:
  LossyTransport(std::unique_ptr<Transport> inner, const Lossiness& lossiness)
      : inner_(std::move(inner)), out_(lossiness, 0), in_(lossiness, 1) {}

  bool send(std::string_view channel, ByteView payload) override {
    const std::lock_guard lock(mutex_);
    out_.put({std::string(channel), Bytes(payload.begin(), payload.end())}, Sender{*inner_});
    return true;
  }

  int receive(std::chrono::microseconds timeout, const Sink& sink) override {
    auto wake = in_.next_due();
    {
      const std::lock_guard lock(mutex_);
      out_.flush(Sender{*inner_});
      wake = std::min(wake, out_.next_due());
    }
    if (wake != Clock::time_point::max()) {
      const auto left = std::chrono::ceil<std::chrono::microseconds>(wake - Clock::now());
      timeout = std::clamp(left, std::chrono::microseconds(0), timeout);
    }
    int count = 0;
    const auto pass = [&](const DelayedMessage& message) {
      ++count;
      sink(message.channel, message.payload);
    };
    const int came = inner_->receive(timeout, [&](std::string_view channel, ByteView payload) {
      in_.put({std::string(channel), Bytes(payload.begin(), payload.end())}, pass);
    });
    if (came == 0) in_.flush(pass);
    return count;
  }

  int file_descriptor() const override { return inner_->file_descriptor(); }
  TransportStats stats() const override { return inner_->stats(); }

 private:
  std::unique_ptr<Transport> inner_;
  std::mutex mutex_;  // of out_: sending and receiving may be two threads
  Channel out_;
  Channel in_;
};

}  // namespace

std::unique_ptr<Transport> make_lossy(std::unique_ptr<Transport> inner,
                                      const Lossiness& lossiness) {
  return std::make_unique<LossyTransport>(std::move(inner), lossiness);
}

}  // namespace cradle
