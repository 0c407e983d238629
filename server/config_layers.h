/// Where the configuration comes from: defaults < file < environment < flags, each layer checked as
/// a whole, so that what is wrong in a file is refused though a flag overrides it.
#pragma once

#include <iosfwd>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/config.h"

namespace cradle {

/// Read by `serve` where no --config is given, if it exists.
constexpr const char* kDefaultConfigFile = "/etc/cradle/cradled.toml";

/// Names and texts, as of an environment or of given flags.
using NamedTexts = std::vector<std::pair<std::string, std::string>>;

struct ConfigSources {
  std::optional<std::string> file;  ///< must exist; none: kDefaultConfigFile, if that exists
  NamedTexts environment;           ///< only what begins with CRADLE_ matters
  NamedTexts flags;                 ///< of Setting::flag()
};

/// The environment of this process.
NamedTexts process_environment();

/// Where a value comes from.
struct Origin {
  std::string place = "default";  ///< or a file, a variable of the environment, a flag
  int line = 0;                   ///< of a file

  std::string text() const { return line > 0 ? place + ":" + std::to_string(line) : place; }
};

/// A configuration, and where each of its values comes from.
struct LoadedConfig {
  LoadedConfig();

  Config values;
  std::map<std::string_view, Origin> origins;  ///< by key, of all keys
};

/// Throws ConfigError with the first fault, with exit code 64 if that is a flag's, and
/// std::filesystem::filesystem_error if the file cannot be read.
LoadedConfig load_config(const ConfigSources& sources);

/// Every fault of one file, each "FILE:LINE: reason", in the order of its lines: its syntax, else
/// its keys and values, and the scene that it names. Throws std::filesystem::filesystem_error if
/// the file cannot be read.
std::vector<std::string> find_faults(const std::string& file);

/// The configuration as a file that says the same, with each value's origin as a comment.
void print_config(std::ostream& out, const LoadedConfig& config);

}  // namespace cradle
