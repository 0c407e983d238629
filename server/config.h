/// How `cradled serve` shall run: defaults, then the configuration file, then flags.
///
/// README.md of tests/scenes documents every key of the file.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace cradle {

struct Config {
  std::string world = "default";
  std::string lcm_url;          ///< empty: that of LcmUrl
  double rate_hz = 0;           ///< ticks a second; 0: as the scene says
  std::string scene;            ///< path; empty: an empty world
  bool lockstep = false;        ///< step only on a step command
  bool allow_control = true;    ///< clients may pause, resume and step
  bool allow_shutdown = false;  ///< clients may end the daemon
  int datagram_bytes = 0;       ///< largest to send; 0: 60000 on this host (ttl=0), else 1400
  int threads = 1;
  int bodies_max = 1'000'000;      ///< that the world takes
  int wrenches_max = 1'000'000;    ///< that act at once
  std::string log_level = "info";  ///< trace, debug, info, warn, error or off
};

/// "FILE:LINE: reason"
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The file's path of a scene is relative to the folder of the configuration file.
/// Throws ConfigError, and std::filesystem::filesystem_error if the file cannot be read.
Config load_config(const std::string& path);

/// A value that cannot be.
struct ConfigFault {
  std::string_view key;
  std::string reason;
};
/// The first fault, if there is one; the defaults have none.
std::optional<ConfigFault> find_fault(const Config& config);

}  // namespace cradle
