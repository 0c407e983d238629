// Which libraries there are depends on what the build found.
#include <array>

#include "tests/bench/peer.h"

#ifndef CRADLE_HAS_BULLET
#define CRADLE_HAS_BULLET 0
#endif
#ifndef CRADLE_HAS_ODE
#define CRADLE_HAS_ODE 0
#endif

namespace cradle::bench {
namespace {

constexpr std::array<PeerLibrary, 2> kLibraries{{
    {"bullet", "libbullet-dev", 10,
#if CRADLE_HAS_BULLET
     make_bullet
#else
     nullptr
#endif
    },
    {"ode", "libode-dev", 20,
#if CRADLE_HAS_ODE
     make_ode
#else
     nullptr
#endif
    },
}};

}  // namespace

std::span<const PeerLibrary> peer_libraries() { return kLibraries; }

}  // namespace cradle::bench
