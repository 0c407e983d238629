#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>
#include <thread>

#include "protocol/transport/lc02_receiver.h"
#include "protocol/transport/lcm_transport.h"
#include "tests/integration/daemon.h"
#include "tests/integration/hostile.h"

namespace cradle {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kChannelAt = 8;  // magic, counter
constexpr std::size_t kRecordedOfAKind = 6;

/// The largest number of bytes that wait in any socket on one of the two ports.
long waiting_bytes(int port) {
  std::ifstream table("/proc/net/udp");
  std::string line;
  std::getline(table, line);
  long most = 0;
  while (std::getline(table, line)) {
    std::replace(line.begin(), line.end(), ':', ' ');
    std::istringstream fields(line);
    std::string slot, address, peer, peer_port, state, sending;
    int local_port = 0;
    long receiving = 0;
    fields >> slot >> address >> std::hex >> local_port >> peer >> peer_port >> state >> sending >>
        receiving;
    if (local_port == port || local_port == port + 1) most = std::max(most, receiving);
  }
  return most;
}

void append(Bytes& bytes, std::uint64_t value, int size) {
  for (int i = size - 1; i >= 0; --i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

Bytes fragment(std::uint32_t size, std::uint32_t offset, std::uint16_t number, std::uint16_t count,
               const std::string& channel) {
  Bytes bytes = {'L', 'C', '0', '3'};
  append(bytes, 7, 4);
  append(bytes, size, 4);
  append(bytes, offset, 4);
  append(bytes, number, 2);
  append(bytes, count, 2);
  if (number == 0) {
    bytes.insert(bytes.end(), channel.begin(), channel.end());
    bytes.push_back(0);
  }
  bytes.insert(bytes.end(), 32, 0xAA);
  return bytes;
}

/// Commands of every kind, so that every kind of message comes; false if one is not answered.
bool do_everything(Client& client) {
  const BodyId ball = spawn_ball(client, {500, 0, 100});
  Wrench push;
  push.body = ball;
  push.value = {1, 0, 0};
  push.duration = WrenchDuration::until_cleared;
  Motion motion;
  motion.body = ball;
  motion.sets_velocity = true;
  motion.v_WBcm = {0, 1, 0};
  const Ticket tickets[] = {client.push(push),
                            client.clear_wrenches(ball),
                            client.set_motion(motion),
                            client.set_gravity({}),
                            client.pause(),
                            client.resume(),
                            client.despawn(ball)};
  return std::all_of(std::begin(tickets), std::end(tickets), [&](const Ticket& ticket) {
    const Result result = client.wait(ticket, 20s).result;
    return result == Result::ok || result == Result::not_allowed;
  });
}

}  // namespace

Attacker::Attacker(const LcmUrl& url)
    : url_(url), socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
Attacker::~Attacker() { ::close(socket_); }

void Attacker::send(Target target, const Bytes& datagram) {
  const bool is_state_port = target == Target::states || target == Target::states_unicast;
  const bool is_unicast = target == Target::control_unicast || target == Target::states_unicast;
  const LcmUrl url = is_state_port ? url_.state_lane() : url_;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(url.port));
  inet_pton(AF_INET, is_unicast ? "127.0.0.1" : url.group.c_str(), &address.sin_addr);
  ::sendto(socket_, datagram.data(), datagram.size(), 0,
           reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

bool Attacker::wait_for_receivers() const {
  constexpr long kFew = 32 << 10;  // of the 208 kB that every socket gets
  const auto deadline = std::chrono::steady_clock::now() + 30s;
  while (waiting_bytes(url_.port) > kFew) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(100us);
  }
  return true;
}

Bytes short_message(const std::string& channel, ByteView payload) {
  Bytes bytes = {'L', 'C', '0', '2', 0, 0, 0, 1};
  bytes.insert(bytes.end(), channel.begin(), channel.end());
  bytes.push_back(0);
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  return bytes;
}

std::vector<Bytes> crafted_datagrams() {
  const Channels channels("test");
  const std::string spawn = channels.name(MessageKind::spawn);
  std::vector<Bytes> all = {
      {},
      {'L'},
      {'L', 'C', '0', '2'},
      {'L', 'C', '0', '2', 0, 0, 0, 0},
      fragment(100000, 0, 0, 2, spawn),
      fragment(100000, 0xfffffff0, 1, 2, spawn),  // liblcm 1.3.1 writes out of bounds
      fragment(0xffffffff, 0, 0, 1, spawn),
      fragment(60000, 0, 0, 1, spawn),
      fragment(1u << 28, 0, 0, 65535, spawn),
      short_message(std::string(300, 'A'), Bytes(10)),
      short_message("", Bytes(10)),
      Bytes(64, 'A'),
      Bytes(65000, 0),
  };
  for (int kind = 0; kind < kMessageKinds; ++kind) {
    for (const std::size_t size : {0u, 8u, 12u, 1400u, 60000u}) {
      for (const int fill : {0x00, 0x7f, 0x80, 0xff}) {
        all.push_back(short_message(channels.name(static_cast<MessageKind>(kind)),
                                    Bytes(size, static_cast<std::uint8_t>(fill))));
      }
    }
  }
  return all;
}

std::vector<Bytes> record_every_kind() {
  const LcmUrl url = *parse_lcm_url(own_url());
  const Channels channels("test");
  std::map<MessageKind, std::vector<Bytes>> recorded;
  const auto record = [&](std::string_view channel, ByteView payload) {
    const auto kind = channels.kind(channel);
    if (!kind || recorded[*kind].size() >= kRecordedOfAKind) return;
    recorded[*kind].push_back(short_message(std::string(channel), payload));
  };
  const OpenedTransport control = open_lcm_transport(url, Lane::send_and_receive);
  const OpenedTransport states = open_lcm_transport(url.state_lane(), Lane::send_and_receive);
  const auto client = connect();
  if (!client || !control.transport || !states.transport || !do_everything(*client)) return {};
  for (int tries = 0; tries < 100 && recorded.size() < kMessageKinds; ++tries) {
    control.transport->receive(50ms, record);
    states.transport->receive(50ms, record);
  }
  std::vector<Bytes> all;
  if (recorded.size() < kMessageKinds) return all;
  for (const auto& [kind, datagrams] : recorded) {
    all.insert(all.end(), datagrams.begin(), datagrams.end());
  }
  return all;
}

Mutator::Mutator(std::vector<Bytes> recorded, unsigned seed)
    : recorded_(std::move(recorded)), random_(seed) {}

Bytes Mutator::next() {
  Bytes datagram = any();
  switch (below(10)) {
    case 0:
      return random_bytes();
    case 1:
      datagram.resize(below(datagram.size() + 1));
      break;
    case 2:
      for (std::size_t left = 1 + below(64); left > 0; --left) datagram.push_back(byte());
      break;
    case 3:
      lie_about_count(datagram);
      break;
    case 4:
      make_fragment(datagram);
      break;
    case 5: {  // the one's head, the other's tail
      const Bytes& other = any();
      const std::size_t at = below(std::min(datagram.size(), other.size()) + 1);
      std::copy_n(other.begin(), at, datagram.begin());
      break;
    }
    case 6: {  // the one's payload on the other's channel
      const auto message = parse_lc02(datagram);
      const auto other = parse_lc02(any());
      if (message && other) datagram = short_message(std::string(other->channel), message->payload);
      break;
    }
    case 7:
      break;  // once more
    default:
      flip_bits(datagram);
  }
  return datagram;
}

Bytes Mutator::random_bytes() {
  Bytes datagram(below(below(16) == 0 ? 4000 : 200));
  for (auto& b : datagram) b = byte();
  if (datagram.size() >= 4 && below(2) == 0) std::copy_n("LC02", 4, datagram.begin());
  return datagram;
}

void Mutator::flip_bits(Bytes& datagram) {
  for (std::size_t left = 1 + below(8); left > 0; --left) {
    auto& target = datagram[below(datagram.size())];
    target = static_cast<std::uint8_t>(target ^ (1u << below(8)));
  }
}

/// The count is what comes after the channel and the fingerprint.
void Mutator::lie_about_count(Bytes& datagram) {
  static constexpr std::array<std::uint32_t, 8> kLies = {
      0, 1, 0xffffffff, 0x7fffffff, 0x80000000, 1u << 24, 1u << 28, 1u << 30};
  const auto zero = std::find(datagram.begin() + kChannelAt, datagram.end(), std::uint8_t{0});
  const auto at = static_cast<std::size_t>(zero - datagram.begin()) + 1 + 8;
  if (at + 4 > datagram.size()) return;
  const std::uint32_t lie = kLies[below(kLies.size())];
  for (std::size_t i = 0; i < 4; ++i) {
    datagram[at + i] = static_cast<std::uint8_t>(lie >> (8 * (3 - i)));
  }
}

void Mutator::make_fragment(Bytes& datagram) {
  Bytes header =
      fragment(static_cast<std::uint32_t>(random_()), static_cast<std::uint32_t>(random_()),
               static_cast<std::uint16_t>(below(3)), static_cast<std::uint16_t>(random_()), "");
  header.resize(20);  // magic, sequence, size, offset, number, count
  datagram.erase(datagram.begin(), datagram.begin() + kChannelAt);
  datagram.insert(datagram.begin(), header.begin(), header.end());
}

}  // namespace cradle
