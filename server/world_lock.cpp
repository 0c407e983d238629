#include "server/world_lock.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <string>
#include <system_error>

namespace cradle {

WorldLock::WorldLock(std::string_view world, std::string_view group, int port)
    : socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
  if (socket_ < 0) throw std::system_error(errno, std::generic_category(), "socket");
  const std::string name =
      "cradle/" + std::string(group) + ':' + std::to_string(port) + '/' + std::string(world);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(name.begin(), name.end(), address.sun_path + 1);  // a first zero: abstract
  const std::size_t length = offsetof(sockaddr_un, sun_path) + 1 + name.size();
  is_held_ = ::bind(socket_, reinterpret_cast<const sockaddr*>(&address),
                    static_cast<socklen_t>(length)) == 0;
  if (!is_held_ && errno != EADDRINUSE) {
    const int error = errno;
    ::close(socket_);
    throw std::system_error(error, std::generic_category(), "the lock of the world");
  }
}

WorldLock::~WorldLock() { ::close(socket_); }

}  // namespace cradle
