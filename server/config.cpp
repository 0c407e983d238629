#include "server/config.h"

#include <cradle/limits.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "protocol/channels.h"
#include "protocol/transport/lcm_url.h"
#include "server/thread_pool.h"
#include "server/toml_reader.h"

namespace cradle {
namespace {

constexpr std::string_view kConfigKeys[] = {
    "world",          "lcm_url",        "rate_hz", "scene",      "lockstep",     "allow_control",
    "allow_shutdown", "datagram_bytes", "threads", "bodies_max", "wrenches_max", "log_level"};
constexpr std::string_view kLogLevels[] = {"trace", "debug", "info", "warn", "error", "off"};

/// Every message fits with one item; the status is the largest.
constexpr int kDatagramBytesMin = 512;

std::string quoted(const std::string& text) { return '"' + text + '"'; }

}  // namespace

Config load_config(const std::string& path) {
  const TomlFile file(read_file(path), path, refuse_with<ConfigError>);
  const TomlTable table(file, kConfigKeys);
  Config config;
  table.read("world", config.world);
  table.read("lcm_url", config.lcm_url);
  table.read("rate_hz", config.rate_hz);
  if (table.read("scene", config.scene) && !config.scene.empty()) {
    config.scene = (std::filesystem::path(path).parent_path() / config.scene).string();
  }
  table.read("lockstep", config.lockstep);
  table.read("allow_control", config.allow_control);
  table.read("allow_shutdown", config.allow_shutdown);
  table.read("datagram_bytes", config.datagram_bytes);
  table.read("threads", config.threads);
  table.read("bodies_max", config.bodies_max);
  table.read("wrenches_max", config.wrenches_max);
  table.read("log_level", config.log_level);
  if (const auto fault = find_fault(config)) table.refuse(fault->key, fault->reason);
  return config;
}

std::optional<ConfigFault> find_fault(const Config& config) {
  const auto is_within = [](double value, double least, double most) {
    return value >= least && value <= most;
  };
  if (!is_world_name(config.world)) {
    return ConfigFault{"world", quoted(config.world) + " is not 1 to " +
                                    std::to_string(limits::kWorldNameBytes) +
                                    " letters, digits, '-' and '_'"};
  }
  if (!parse_lcm_url(config.lcm_url)) {
    return ConfigFault{"lcm_url", quoted(config.lcm_url) + " is not like " + LcmUrl().text() +
                                      ", with a multicast group and a port of 1024 to 65534"};
  }
  if (config.rate_hz != 0 && !is_within(config.rate_hz, limits::kRateMin_hz, limits::kRateMax_hz)) {
    return ConfigFault{"rate_hz", "must be 0 (as the scene says) or 1 to 10000"};
  }
  if (config.datagram_bytes != 0 &&
      !is_within(config.datagram_bytes, kDatagramBytesMin, limits::kLoopbackDatagramBytes)) {
    return ConfigFault{"datagram_bytes", "must be 0 (as the network allows) or 512 to 60000"};
  }
  if (!is_within(config.bodies_max, 0, limits::kBodies)) {
    return ConfigFault{"bodies_max", "must be 0 to " + std::to_string(limits::kBodies)};
  }
  if (!is_within(config.wrenches_max, 0, limits::kWrenches)) {
    return ConfigFault{"wrenches_max", "must be 0 to " + std::to_string(limits::kWrenches)};
  }
  if (!is_within(config.threads, 1, ThreadPool::kThreadsMax)) {
    return ConfigFault{"threads", "must be 1 to 256"};
  }
  if (std::find(std::begin(kLogLevels), std::end(kLogLevels), config.log_level) ==
      std::end(kLogLevels)) {
    return ConfigFault{
        "log_level", quoted(config.log_level) + " is none of trace, debug, info, warn, error, off"};
  }
  return std::nullopt;
}

}  // namespace cradle
