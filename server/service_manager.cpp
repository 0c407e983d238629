#include "server/service_manager.h"

#include <sys/socket.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string_view>

namespace cradle {
namespace {

/// A positive number of the environment; 0 if there is none.
std::int64_t number_in(const char* variable) {
  const char* const text = std::getenv(variable);
  std::int64_t value = 0;
  if (text != nullptr) std::from_chars(text, text + std::strlen(text), value);
  return value > 0 ? value : 0;
}

/// A timer that is readable that often; -1 if that is impossible.
int repeating_timer(std::int64_t period_us) {
  const timespec period{period_us / 1'000'000, period_us % 1'000'000 * 1000};
  const itimerspec timer{period, period};
  const int descriptor = ::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK);
  ::timerfd_settime(descriptor, 0, &timer, nullptr);
  return descriptor;
}

}  // namespace

ServiceManager::ServiceManager() {
  const char* const name = std::getenv("NOTIFY_SOCKET");
  if (name == nullptr || *name == 0) return;
  const std::string_view path = name;
  address_.sun_family = AF_UNIX;
  const std::size_t bytes = std::min(path.size(), sizeof address_.sun_path);
  std::memcpy(address_.sun_path, path.data(), bytes);
  if (path[0] == '@') address_.sun_path[0] = 0;  // a name that is no file
  address_bytes_ = static_cast<unsigned>(offsetof(sockaddr_un, sun_path) + bytes);
  socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);

  const std::int64_t watched_process = number_in("WATCHDOG_PID");
  const std::int64_t period_us = number_in("WATCHDOG_USEC");
  if (period_us == 0 || (watched_process != 0 && watched_process != ::getpid())) return;
  constexpr std::int64_t kShortest_us = 1000;  // the loop has more to do
  watchdog_ = repeating_timer(std::max(period_us / 4, kShortest_us));
}

ServiceManager::~ServiceManager() {
  if (socket_ >= 0) ::close(socket_);
  if (watchdog_ >= 0) ::close(watchdog_);
}

bool ServiceManager::watched() {
  std::uint64_t expired = 0;
  const bool is_due = watchdog_ >= 0 && ::read(watchdog_, &expired, sizeof expired) > 0;
  return !is_due || tell("WATCHDOG=1");
}

bool ServiceManager::status(const WorldStatus& status) {
  char text[256];
  std::snprintf(text, sizeof text,
                "STATUS=world %s: tick %lld, %lld bodies, real-time factor %.2f, %lld clients%s%s",
                status.name.c_str(), static_cast<long long>(status.tick),
                static_cast<long long>(status.bodies), status.real_time_factor,
                static_cast<long long>(status.clients), status.paused ? ", paused" : "",
                status.lockstep ? ", lockstep" : "");
  return tell(text);
}

bool ServiceManager::reloading() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  const std::int64_t now_us = std::int64_t{now.tv_sec} * 1'000'000 + now.tv_nsec / 1000;
  return tell("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(now_us));
}

bool ServiceManager::tell(const std::string& message) {
  if (address_bytes_ == 0) return true;
  const auto sent = ::sendto(socket_, message.data(), message.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                             reinterpret_cast<const sockaddr*>(&address_), address_bytes_);
  error_ = sent < 0 ? errno : 0;
  return error_ == 0;
}

}  // namespace cradle
