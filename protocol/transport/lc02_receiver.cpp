#include "protocol/transport/lc02_receiver.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace cradle {
namespace {

constexpr int kBatch = 32;
constexpr int kBatches = 256;
constexpr std::size_t kDatagramBytes = 65536;
constexpr int kReceiveBufferBytes = 4 << 20;  // bursts of states overflow the default one
constexpr std::size_t kHeaderBytes = 8;
constexpr std::size_t kChannelBytes = 64;  // with its zero
constexpr std::array<std::uint8_t, 4> kMagic = {'L', 'C', '0', '2'};
constexpr std::array<std::uint8_t, 4> kFragmentMagic = {'L', 'C', '0', '3'};

void check(int result, const char* what) {
  if (result < 0) throw std::system_error(errno, std::generic_category(), what);
}

template <class Value>
void set_option(int socket, int level, int name, const Value& value, const char* what) {
  check(::setsockopt(socket, level, name, &value, sizeof value), what);
}

/// The kernel's count of datagrams that found the buffer full, if it came with this message.
std::optional<std::uint32_t> overflow_count(const msghdr& header) {
  auto& mutable_header = const_cast<msghdr&>(header);
  for (cmsghdr* c = CMSG_FIRSTHDR(&mutable_header); c != nullptr;
       c = CMSG_NXTHDR(&mutable_header, c)) {
    if (c->cmsg_level == SOL_SOCKET && c->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t count = 0;
      std::memcpy(&count, CMSG_DATA(c), sizeof count);
      return count;
    }
  }
  return std::nullopt;
}

}  // namespace

struct Lc02Receiver::Buffers {
  std::array<mmsghdr, kBatch> headers{};
  std::array<iovec, kBatch> vectors{};
  std::array<std::array<std::uint8_t, CMSG_SPACE(sizeof(std::uint32_t))>, kBatch> control{};
  std::vector<std::uint8_t> bytes = std::vector<std::uint8_t>(kBatch * kDatagramBytes);

  /// Points every header at its buffers again: the kernel has overwritten the lengths.
  void reset() {
    for (std::size_t i = 0; i < kBatch; ++i) {
      vectors[i] = {bytes.data() + i * kDatagramBytes, kDatagramBytes};
      headers[i] = {};
      headers[i].msg_hdr.msg_iov = &vectors[i];
      headers[i].msg_hdr.msg_iovlen = 1;
      headers[i].msg_hdr.msg_control = control[i].data();
      headers[i].msg_hdr.msg_controllen = control[i].size();
    }
  }
};

std::optional<Lc02Message> parse_lc02(ByteView datagram, DatagramFault* fault) {
  const auto refuse = [fault](DatagramFault why) {
    if (fault != nullptr) *fault = why;
    return std::nullopt;
  };
  if (datagram.size() <= kHeaderBytes) return refuse(DatagramFault::too_short);
  const auto begins_with = [&](const auto& magic) {
    return std::equal(magic.begin(), magic.end(), datagram.begin());
  };
  if (begins_with(kFragmentMagic)) return refuse(DatagramFault::fragment);
  if (!begins_with(kMagic)) return refuse(DatagramFault::bad_magic);
  const ByteView rest = datagram.subspan(kHeaderBytes);
  const ByteView channel_field = rest.first(std::min(rest.size(), kChannelBytes));
  const auto zero = std::find(channel_field.begin(), channel_field.end(), std::uint8_t{0});
  if (zero == channel_field.end()) return refuse(DatagramFault::bad_channel);
  const auto length = static_cast<std::size_t>(zero - channel_field.begin());
  return Lc02Message{{reinterpret_cast<const char*>(rest.data()), length},
                     rest.subspan(length + 1)};
}

Lc02Receiver::Lc02Receiver(const LcmUrl& url)
    : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)),
      buffers_(std::make_unique<Buffers>()) {
  check(socket_, "socket");
  try {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(url.port));
    inet_pton(AF_INET, url.group.c_str(), &address.sin_addr);

    set_option(socket_, SOL_SOCKET, SO_REUSEADDR, 1, "SO_REUSEADDR");
    set_option(socket_, SOL_SOCKET, SO_RCVBUF, kReceiveBufferBytes, "SO_RCVBUF");
    set_option(socket_, SOL_SOCKET, SO_RXQ_OVFL, 1, "SO_RXQ_OVFL");
    set_option(socket_, IPPROTO_IP, IP_MULTICAST_ALL, 0, "IP_MULTICAST_ALL");
    check(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), "bind");
    ip_mreq membership{};
    membership.imr_multiaddr = address.sin_addr;
    set_option(socket_, IPPROTO_IP, IP_ADD_MEMBERSHIP, membership, "IP_ADD_MEMBERSHIP");

    socklen_t size = sizeof stats_.receive_buffer_bytes;
    check(::getsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &stats_.receive_buffer_bytes, &size),
          "SO_RCVBUF");
  } catch (...) {
    ::close(socket_);
    throw;
  }
}

Lc02Receiver::~Lc02Receiver() { ::close(socket_); }

int Lc02Receiver::receive(std::chrono::microseconds timeout, const Transport::Sink& sink) {
  pollfd waiting{socket_, POLLIN, 0};
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(timeout);
  const timespec wait{seconds.count(), std::chrono::nanoseconds(timeout - seconds).count()};
  if (::ppoll(&waiting, 1, &wait, nullptr) <= 0) return 0;

  int handed_on = 0;
  for (int batch = 0; batch < kBatches; ++batch) {
    buffers_->reset();
    const int count = ::recvmmsg(socket_, buffers_->headers.data(), kBatch, MSG_DONTWAIT, nullptr);
    for (int i = 0; i < count; ++i) {
      const mmsghdr& header = buffers_->headers[static_cast<std::size_t>(i)];
      if (const auto dropped = overflow_count(header.msg_hdr)) stats_.dropped_by_kernel = *dropped;
      const ByteView datagram{static_cast<const std::uint8_t*>(header.msg_hdr.msg_iov->iov_base),
                              header.msg_len};
      auto fault = DatagramFault::too_long;
      const bool is_whole = (header.msg_hdr.msg_flags & MSG_TRUNC) == 0;
      const auto message = is_whole ? parse_lc02(datagram, &fault) : std::nullopt;
      if (!message) {
        stats_.count(fault);
        continue;
      }
      ++stats_.received;
      ++handed_on;
      sink(message->channel, message->payload);
    }
    if (count < kBatch) break;
  }
  return handed_on;
}

}  // namespace cradle
