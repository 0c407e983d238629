/// The libraries that this was built with.
#pragma once

#include <vector>

#include "tests/bench/peer.h"

namespace cradle::bench {

inline std::vector<PeerLibrary> libraries_here() {
  std::vector<PeerLibrary> found;
  for (const PeerLibrary& library : peer_libraries()) {
    if (library.make != nullptr) found.push_back(library);
  }
  return found;
}

}  // namespace cradle::bench
