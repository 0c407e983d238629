// Lc02Receiver on a real socket. The input is cut into datagrams of several senders, one of which
// knows only the host's address: what is a whole short message to the group arrives byte for byte,
// the rest of what was sent to the group is counted, and unicast is not heard.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>
#include <utility>

#include "protocol/transport/lc02_receiver.h"
#include "tests/fuzz/input.h"

namespace cradle::fuzz {
namespace {

using Message = std::pair<std::string, Bytes>;  // channel, payload

constexpr int kDatagramsMax = 64;  // few enough for the default receive buffer
constexpr std::size_t kSenders = 4;
constexpr std::size_t kUnicastSender = kSenders - 1;

/// The format once more, as LCM documents it: LC02, counter, channel of at most 63 bytes and a
/// zero, payload.
std::optional<Message> whole_message(const Bytes& datagram) {
  constexpr std::size_t kChannelAt = 8;
  if (datagram.size() <= kChannelAt || std::memcmp(datagram.data(), "LC02", 4) != 0) {
    return std::nullopt;
  }
  std::string channel;
  for (std::size_t i = kChannelAt; i < datagram.size() && channel.size() < 64; ++i) {
    if (datagram[i] == 0) {
      return Message{channel,
                     {datagram.begin() + static_cast<std::ptrdiff_t>(i) + 1, datagram.end()}};
    }
    channel.push_back(static_cast<char>(datagram[i]));
  }
  return std::nullopt;
}

/// The receiver, and the sockets of those who send to it; on a port of this process's own.
class Network {
 public:
  Network() : url_{"239.255.76.67", 10000 + 2 * (::getpid() % 11000), 0}, receiver_(url_) {
    for (int& socket : senders_) socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  }
  ~Network() {
    for (int socket : senders_) ::close(socket);
  }
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  bool send(std::size_t sender, const Bytes& datagram) const {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(url_.port));
    const char* const host = sender == kUnicastSender ? "127.0.0.1" : url_.group.c_str();
    inet_pton(AF_INET, host, &address.sin_addr);
    return ::sendto(senders_[sender], datagram.data(), datagram.size(), 0,
                    reinterpret_cast<const sockaddr*>(&address), sizeof address) >= 0;
  }

  /// Until `count` datagrams have come, taken or rejected.
  std::vector<Message> receive(std::int64_t count) {
    using namespace std::chrono_literals;
    std::vector<Message> messages;
    const auto heard = [this] { return receiver_.stats().received + receiver_.stats().rejected(); };
    const std::int64_t before = heard();
    for (int tries = 0; tries < 50 && (tries == 0 || heard() - before < count); ++tries) {
      receiver_.receive(count == 0 ? 0us : 100ms, [&](std::string_view channel, ByteView payload) {
        messages.emplace_back(channel, Bytes(payload.begin(), payload.end()));
      });
    }
    require(heard() - before == count, "every datagram to the group is counted, and no other");
    require(receiver_.stats().dropped_by_kernel == 0, "few datagrams find room");
    return messages;
  }

 private:
  LcmUrl url_;
  Lc02Receiver receiver_;
  std::array<int, kSenders> senders_{};
};

void run(Input input) {
  static Network network;
  std::vector<Message> sent;
  std::int64_t count = 0;
  for (int i = 0; i < kDatagramsMax && !input.is_empty(); ++i) {
    const std::size_t sender = input.below(kSenders);
    Bytes datagram;
    if (!input.one_in(2)) datagram = {'L', 'C', '0', '2', 0, 0, 0, static_cast<std::uint8_t>(i)};
    const ByteView rest = input.take(input.any<std::uint16_t>());
    datagram.insert(datagram.end(), rest.begin(), rest.end());
    if (!network.send(sender, datagram) || sender == kUnicastSender) continue;
    ++count;
    if (auto message = whole_message(datagram)) sent.push_back(std::move(*message));
  }
  auto received = network.receive(count);
  // Datagrams of several senders have no order among them.
  std::sort(sent.begin(), sent.end());
  std::sort(received.begin(), received.end());
  require(sent == received, "whole messages arrive byte for byte, and nothing else does");
}

}  // namespace
}  // namespace cradle::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  cradle::fuzz::run(cradle::fuzz::Input({data, size}));
  return 0;
}
