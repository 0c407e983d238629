/// Other physics libraries, with worlds made of our scenes: one file a library.
#pragma once

#include <memory>
#include <span>
#include <stdexcept>
#include <string_view>

#include "server/scene.h"
#include "tests/bench/masses.h"

namespace cradle::bench {

/// What of a scene a library cannot have, and why.
class PeerError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a sweep changes; else the library's defaults.
struct PeerSettings {
  int iterations = 0;    ///< of its solver; 0: the library's default
  int steps_a_tick = 1;  ///< equal steps, each with collision
};

/// A world of another library. Not to be shared by threads.
class Peer {
 public:
  virtual ~Peer() = default;
  /// `geometry` is that which the shape names, or null. Throws PeerError.
  virtual void add(const BodySpec& body, const BodyMass& mass, const StoredGeometry* geometry) = 0;
  /// One tick.
  virtual void step() = 0;
  /// Of the body that was added as number `number`, from 0 on.
  virtual BodyState state(std::size_t number) const = 0;
};

struct PeerLibrary {
  std::string_view name;
  std::string_view package;  ///< of Debian
  int iterations;            ///< its default
  /// Null if this program was built without the library.
  std::unique_ptr<Peer> (*make)(const WorldSettings& world, const PeerSettings& settings);
};

/// All that there are, with and without `make`.
std::span<const PeerLibrary> peer_libraries();

/// A world with the bodies of the scene, in their order. Throws PeerError, also for what no peer
/// is given: drag, springs, wrenches, kinematic bodies, planar worlds, and bodies whose centre of
/// mass or principal axes are not those of their frame.
std::unique_ptr<Peer> make_peer(const PeerLibrary& library, const Scene& scene,
                                const PeerSettings& settings);

// peer_bullet.cpp
std::unique_ptr<Peer> make_bullet(const WorldSettings& world, const PeerSettings& settings);
// peer_ode.cpp
std::unique_ptr<Peer> make_ode(const WorldSettings& world, const PeerSettings& settings);

}  // namespace cradle::bench
