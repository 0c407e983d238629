/// A transport that loses, doubles, delays and reorders what another one carries, in both
/// directions, from a seed: for tests of everything that must survive a bad network.
#pragma once

#include <chrono>
#include <memory>

#include "protocol/transport/transport.h"

namespace cradle {

struct Lossiness {
  std::uint64_t seed = 1;
  double loss = 0;         ///< probability that a message vanishes
  double duplication = 0;  ///< that it comes twice
  double reordering = 0;   ///< that it is held back behind up to `held_back_max` later ones
  int held_back_max = 8;
  std::chrono::microseconds delay_max{0};  ///< every message is late by up to this, wall time
};

/// Applies `lossiness` to every message sent and to every message received. A message held back
/// goes on when as many others as it was to wait for have passed, or at the next call of receive();
/// one that is late goes on with the first call after its time, for which receive() wakes.
/// What vanishes counts as sent, or as not received: the network would not tell either.
std::unique_ptr<Transport> make_lossy(std::unique_ptr<Transport> inner, const Lossiness& lossiness);

}  // namespace cradle
