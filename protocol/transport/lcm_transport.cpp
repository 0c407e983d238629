#include "protocol/transport/lcm_transport.h"

#include <arpa/inet.h>
#include <lcm/lcm.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <mutex>
#include <system_error>

#include "protocol/transport/lc02_receiver.h"

namespace cradle {
namespace {

struct LcmDeleter {
  void operator()(lcm_t* lcm) const { lcm_destroy(lcm); }
};

class LcmTransport final : public Transport {
 public:
  LcmTransport(lcm_t* lcm, std::unique_ptr<Lc02Receiver> receiver)
      : lcm_(lcm), receiver_(std::move(receiver)) {
    if (receiver_) received_ = receiver_->stats();
  }

  bool send(std::string_view channel, ByteView payload) override {
    const std::string name(channel);
    const bool is_sent = lcm_publish(lcm_.get(), name.c_str(), payload.data(),
                                     static_cast<unsigned>(payload.size())) == 0;
    ++(is_sent ? sent_ : send_failures_);
    if (is_sent) sent_bytes_ += static_cast<std::int64_t>(payload.size());
    return is_sent;
  }

  int receive(std::chrono::microseconds timeout, const Sink& sink) override {
    if (!receiver_) return 0;
    const int count = receiver_->receive(timeout, sink);
    const std::lock_guard lock(mutex_);
    received_ = receiver_->stats();
    return count;
  }

  TransportStats stats() const override {
    const std::lock_guard lock(mutex_);
    TransportStats stats = received_;
    stats.sent = sent_;
    stats.sent_bytes = sent_bytes_;
    stats.send_failures = send_failures_;
    return stats;
  }

  int file_descriptor() const override { return receiver_ ? receiver_->file_descriptor() : -1; }

 private:
  std::unique_ptr<lcm_t, LcmDeleter> lcm_;
  std::unique_ptr<Lc02Receiver> receiver_;
  std::atomic<std::int64_t> sent_ = 0;
  std::atomic<std::int64_t> sent_bytes_ = 0;
  std::atomic<std::int64_t> send_failures_ = 0;
  mutable std::mutex mutex_;
  TransportStats received_;
};

/// Why the host cannot reach the group, or an empty text. liblcm would print several lines.
std::string route_fault(const LcmUrl& url) {
  const int probe = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(url.port));
  inet_pton(AF_INET, url.group.c_str(), &address.sin_addr);
  const int result = ::connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  const int error = errno;
  ::close(probe);
  return result == 0 ? "" : std::strerror(error);
}

OpenedTransport failure(const LcmUrl& url, const std::string& reason) {
  return {nullptr, Result::no_network,
          "no multicast to " + url.group + " (" + reason +
              "); for this host alone type: ip link set lo up && ip route add 224.0.0.0/4 dev lo"};
}

/// Somebody has the port for himself; whoever uses LCM shares it.
OpenedTransport taken(const LcmUrl& url) {
  return {nullptr, Result::no_network,
          "port " + std::to_string(url.port) + " is in use by a program that does not share it; " +
              "choose another, best below 32768: those above are lent to any program"};
}

}  // namespace

OpenedTransport open_lcm_transport(const LcmUrl& url, Lane lane) {
  if (const std::string fault = route_fault(url); !fault.empty()) return failure(url, fault);
  std::unique_ptr<Lc02Receiver> receiver;
  if (lane == Lane::send_and_receive) {
    try {
      receiver = std::make_unique<Lc02Receiver>(url);
    } catch (const std::system_error& error) {
      if (error.code() == std::errc::address_in_use) return taken(url);
      return failure(url, error.what());
    }
  }
  lcm_t* const lcm = lcm_create(url.text().c_str());
  if (lcm == nullptr) return failure(url, "liblcm cannot open " + url.text());
  return {std::make_unique<LcmTransport>(lcm, std::move(receiver)), Result::ok, ""};
}

}  // namespace cradle
