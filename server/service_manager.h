/// What a service manager is told through the socket that NOTIFY_SOCKET names, see sd_notify(3).
/// Without one, nothing happens.
///
/// Not by libsystemd: its sends wait for a manager that does not read, and the world with them.
#pragma once

#include <cradle/world_view.h>
#include <sys/un.h>

#include <string>

namespace cradle {

class ServiceManager {
 public:
  ServiceManager();
  ~ServiceManager();
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;

  /// Readable when watched() should be called: four times in the period that WATCHDOG_USEC gives,
  /// for a tick may come between. -1 where nobody watches.
  int watchdog_descriptor() const { return watchdog_; }

  // None of them waits; false if there is a manager, and it has not been told.
  bool watched();
  bool ready() { return tell("READY=1"); }
  bool status(const WorldStatus& status);
  bool reloading();
  bool stopping() { return tell("STOPPING=1"); }

  /// Why it was not told the last time, as an errno; 0: it was.
  int error() const { return error_; }

 private:
  bool tell(const std::string& message);

  sockaddr_un address_{};
  unsigned address_bytes_ = 0;  ///< 0: there is no manager
  int socket_ = -1;
  int watchdog_ = -1;  ///< a timer
  int error_ = 0;
};

}  // namespace cradle
