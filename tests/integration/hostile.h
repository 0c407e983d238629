/// What hostile tests share: datagrams recorded from a world that works, mutations of them, and
/// somebody who sends them as anyone on the host could.
#pragma once

#include <array>
#include <random>
#include <string>
#include <vector>

#include "protocol/transport/lcm_url.h"
#include "protocol/transport/transport.h"

namespace cradle {

/// What a sender can aim at: both ports of a world, by the group or by the host's own address.
enum class Target { control, states, control_unicast, states_unicast };

/// Sends datagrams, no faster than those who hear them take them.
class Attacker {
 public:
  explicit Attacker(const LcmUrl& url);
  ~Attacker();
  Attacker(const Attacker&) = delete;
  Attacker& operator=(const Attacker&) = delete;

  void send(Target target, const Bytes& datagram);
  /// False if somebody on one of the ports has not emptied its buffer within half a minute.
  bool wait_for_receivers() const;

 private:
  LcmUrl url_;
  int socket_;
};

/// An LC02 short message as liblcm sends it.
Bytes short_message(const std::string& channel, ByteView payload);

/// Datagrams that crash, or once crashed, receivers of LCM, and their relatives.
std::vector<Bytes> crafted_datagrams();

/// Datagrams of the world "test" on own_url(), some of every kind of message, as a client that does
/// everything makes them come. Empty if that fails.
std::vector<Bytes> record_every_kind();

/// Makes hostile datagrams of `recorded` ones: random bytes, flipped bits, cut and extended ones,
/// counts that lie, fragment headers, halves swapped, channels exchanged, and plain repetitions.
class Mutator {
 public:
  Mutator(std::vector<Bytes> recorded, unsigned seed);
  Bytes next();

 private:
  std::size_t below(std::size_t end) { return random_() % end; }
  std::uint8_t byte() { return static_cast<std::uint8_t>(random_()); }
  const Bytes& any() { return recorded_[below(recorded_.size())]; }
  Bytes random_bytes();
  void flip_bits(Bytes& datagram);
  void lie_about_count(Bytes& datagram);
  void make_fragment(Bytes& datagram);

  std::vector<Bytes> recorded_;
  std::mt19937_64 random_;
};

}  // namespace cradle
