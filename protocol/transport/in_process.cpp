#include "protocol/transport/in_process.h"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <utility>
#include <vector>

namespace cradle {
namespace {

constexpr std::size_t kWaitingMax = 65536;

}  // namespace

struct InProcessBus::Hub {
  struct Message {
    std::string channel;
    std::shared_ptr<const Bytes> payload;
  };

  struct Mailbox {
    std::mutex mutex;
    std::condition_variable arrival;
    std::deque<Message> waiting;
    TransportStats stats;

    void put(const Message& message) {
      const std::lock_guard lock(mutex);
      if (waiting.size() >= kWaitingMax) {
        ++stats.dropped_by_kernel;
        return;
      }
      waiting.push_back(message);
      arrival.notify_one();
    }

    std::deque<Message> take(std::chrono::microseconds timeout) {
      std::unique_lock lock(mutex);
      // Waiting for no time at all still puts the thread to sleep.
      if (timeout.count() > 0) arrival.wait_for(lock, timeout, [this] { return !waiting.empty(); });
      stats.received += static_cast<std::int64_t>(waiting.size());
      return std::exchange(waiting, {});
    }
  };

  std::mutex mutex;
  std::vector<std::weak_ptr<Mailbox>> mailboxes;

  void send(const Message& message) {
    const std::lock_guard lock(mutex);
    std::erase_if(mailboxes, [](const auto& mailbox) { return mailbox.expired(); });
    for (const auto& weak : mailboxes) {
      if (const auto mailbox = weak.lock()) mailbox->put(message);
    }
  }

  class Participant;
};

class InProcessBus::Hub::Participant final : public Transport {
 public:
  explicit Participant(std::shared_ptr<Hub> hub) : hub_(std::move(hub)) {
    const std::lock_guard lock(hub_->mutex);
    hub_->mailboxes.push_back(mailbox_);
  }

  bool send(std::string_view channel, ByteView payload) override {
    hub_->send({std::string(channel), std::make_shared<Bytes>(payload.begin(), payload.end())});
    const std::lock_guard lock(mailbox_->mutex);
    ++mailbox_->stats.sent;
    mailbox_->stats.sent_bytes += static_cast<std::int64_t>(payload.size());
    return true;
  }

  int receive(std::chrono::microseconds timeout, const Sink& sink) override {
    const auto messages = mailbox_->take(timeout);
    for (const Message& message : messages) sink(message.channel, *message.payload);
    return static_cast<int>(messages.size());
  }

  TransportStats stats() const override {
    const std::lock_guard lock(mailbox_->mutex);
    return mailbox_->stats;
  }

 private:
  std::shared_ptr<Hub> hub_;
  std::shared_ptr<Mailbox> mailbox_ = std::make_shared<Mailbox>();
};

InProcessBus::InProcessBus() : hub_(std::make_shared<Hub>()) {}

std::unique_ptr<Transport> InProcessBus::join() { return std::make_unique<Hub::Participant>(hub_); }

}  // namespace cradle
