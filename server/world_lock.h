/// One daemon a world and host.
#pragma once

#include <string_view>

namespace cradle {

/// Holds the name of a world at a group and port while it lives. The lock is an abstract Unix
/// socket: it reaches as far as the port does, to the end of the network namespace, leaves no file,
/// needs no permission, and ends with the process however that ends.
class WorldLock {
 public:
  /// Throws std::system_error where there are no such sockets.
  WorldLock(std::string_view world, std::string_view group, int port);
  ~WorldLock();
  WorldLock(const WorldLock&) = delete;
  WorldLock& operator=(const WorldLock&) = delete;

  /// False if another process serves this world there.
  bool is_held() const { return is_held_; }

 private:
  int socket_ = -1;
  bool is_held_ = false;
};

}  // namespace cradle
