/// A port inside one process: for tests, and for a game that hosts its own server.
#pragma once

#include "protocol/transport/transport.h"

namespace cradle {

/// Carries messages between the transports made from it; may be destroyed before them.
class InProcessBus {
 public:
  InProcessBus();

  /// A participant; it hears everything sent from now on, its own messages included.
  std::unique_ptr<Transport> join();

 private:
  struct Hub;
  std::shared_ptr<Hub> hub_;
};

}  // namespace cradle
