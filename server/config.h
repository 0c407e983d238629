/// How `cradled serve` shall run: one table of everything that can be set.
///
/// The file, the environment, the flags, `print-config`, `check` and a reload all walk the table
/// (config_layers.h). A new key is a field of Config, a line of the table in config.cpp, and a line
/// each in README.md of tests/scenes and in server/deploy/cradled.toml; tests find what is missing.
#pragma once

#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>

#include "server/exit_code.h"
#include "server/scene.h"

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
  int memory_mib = 64;              ///< taken at the start, MiB
  int bodies_max = 1'000'000;       ///< that the world takes
  int wrenches_max = 1'000'000;     ///< that act at once
  std::string log_level = "info";   ///< trace, debug, info, warn, error or off
  std::string log_format = "text";  ///< text or json
  std::string metrics;              ///< address of the page, like 127.0.0.1:9464; empty: none
};

/// Something that can be set.
struct Setting {
  using Field =
      std::variant<bool Config::*, int Config::*, double Config::*, std::string Config::*>;

  std::string_view key;      ///< in files; in upper case, after CRADLE_, in the environment
  Field field;               ///< its type is the key's
  std::string_view meaning;  ///< for --help
  /// What is wrong with the value; empty: nothing. None: every value of the type can be.
  std::string (*fault)(const Config&) = nullptr;
  bool is_reloadable = false;  ///< by SIGHUP, in a world that runs
  bool is_path = false;        ///< relative to the file that names it

  std::string variable() const;  ///< of the environment
  std::string flag() const;      ///< of the command line
};

/// All of them, in the order of the documentation.
std::span<const Setting> all_settings();

/// The value as TOML: what a configuration file says after the '='.
std::string value_text(const Setting& setting, const Config& config);

/// "ORIGIN: reason", where the origin is FILE:LINE, a variable of the environment, or a flag.
struct ConfigError : std::runtime_error {
  explicit ConfigError(const std::string& line, int code = kExitConfig)
      : std::runtime_error(line), exit_code(code) {}
  int exit_code;
};

/// The scene that a world begins with, with what the configuration says about it.
/// Throws what load_scene does.
Scene first_scene(const Config& config);

}  // namespace cradle
