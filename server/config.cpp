#include "server/config.h"

#include <cradle/limits.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <sstream>
#include <type_traits>

#include "protocol/channels.h"
#include "protocol/transport/lcm_url.h"
#include "server/metrics_page.h"
#include "server/thread_pool.h"

namespace cradle {
namespace {

constexpr std::string_view kLogLevels[] = {"trace", "debug", "info", "warn", "error", "off"};

/// Every message fits with one item; the status is the largest.
constexpr int kDatagramBytesMin = 512;

/// A million bodies in a heap take 15 GB.
constexpr int kMemoryMax_mib = 65536;

bool is_within(double value, double least, double most) { return value >= least && value <= most; }

/// What a setting's check says of its value: nothing if it can be, else `reason`.
std::string unless(bool is_good, const std::string& reason) { return is_good ? "" : reason; }
std::string unless(bool is_good, const std::string& value, const std::string& reason) {
  return unless(is_good, '"' + value + "\" " + reason);
}
std::string unless_within(int value, int least, int most) {
  return unless(is_within(value, least, most),
                "must be " + std::to_string(least) + " to " + std::to_string(most));
}

std::string check_world(const Config& c) {
  return unless(
      is_world_name(c.world), c.world,
      "is not 1 to " + std::to_string(limits::kWorldNameBytes) + " letters, digits, '-' and '_'");
}
std::string check_lcm_url(const Config& c) {
  return unless(
      parse_lcm_url(c.lcm_url).has_value(), c.lcm_url,
      "is not like " + LcmUrl().text() + ", with a multicast group and a port of 1024 to 65534");
}
std::string check_rate(const Config& c) {
  return unless(c.rate_hz == 0 || is_within(c.rate_hz, limits::kRateMin_hz, limits::kRateMax_hz),
                "must be 0 (as the scene says) or 1 to 10000");
}
std::string check_datagram_bytes(const Config& c) {
  return unless(c.datagram_bytes == 0 ||
                    is_within(c.datagram_bytes, kDatagramBytesMin, limits::kLoopbackDatagramBytes),
                "must be 0 (as the network allows) or 512 to 60000");
}
std::string check_threads(const Config& c) {
  return unless_within(c.threads, 1, ThreadPool::kThreadsMax);
}
std::string check_memory(const Config& c) { return unless_within(c.memory_mib, 0, kMemoryMax_mib); }
std::string check_bodies_max(const Config& c) {
  return unless_within(c.bodies_max, 0, limits::kBodies);
}
std::string check_wrenches_max(const Config& c) {
  return unless_within(c.wrenches_max, 0, limits::kWrenches);
}
std::string check_log_level(const Config& c) {
  return unless(
      std::find(std::begin(kLogLevels), std::end(kLogLevels), c.log_level) != std::end(kLogLevels),
      c.log_level, "is none of trace, debug, info, warn, error, off");
}
std::string check_log_format(const Config& c) {
  return unless(c.log_format == "text" || c.log_format == "json", c.log_format,
                "is neither text nor json");
}
std::string check_metrics(const Config& c) {
  return unless(c.metrics.empty() || parse_page_address(c.metrics), c.metrics,
                "is not an address of loopback like 127.0.0.1:9464");
}

constexpr bool kReloadable = true;
constexpr bool kNeedsRestart = false;
constexpr bool kPath = true;

// clang-format off
const Setting kSettings[] = {
    {"world", &Config::world, "name of the world", check_world},
    {"lcm_url", &Config::lcm_url, "like udpm://239.255.76.67:7667?ttl=0", check_lcm_url},
    {"rate_hz", &Config::rate_hz, "ticks a second, instead of the scene's", check_rate},
    {"scene", &Config::scene, "scene to begin with (TOML)", nullptr, kNeedsRestart, kPath},
    {"lockstep", &Config::lockstep, "step only on a client's step command"},
    {"allow_control", &Config::allow_control, "clients may pause, resume and step", nullptr, kReloadable},
    {"allow_shutdown", &Config::allow_shutdown, "clients may end the daemon", nullptr, kReloadable},
    {"datagram_bytes", &Config::datagram_bytes, "largest datagram to send; 0: as the network allows", check_datagram_bytes},
    {"threads", &Config::threads, "threads that step the world", check_threads},
    {"memory_mib", &Config::memory_mib, "memory taken at the start, so that no tick waits for it", check_memory},
    {"bodies_max", &Config::bodies_max, "bodies that the world takes", check_bodies_max},
    {"wrenches_max", &Config::wrenches_max, "wrenches that act at once", check_wrenches_max},
    {"log_level", &Config::log_level, "trace, debug, info, warn, error or off", check_log_level, kReloadable},
    {"log_format", &Config::log_format, "text or json", check_log_format},
    {"metrics", &Config::metrics, "serve metrics for Prometheus on this address of loopback, like 127.0.0.1:9464", check_metrics},
};
// clang-format on

}  // namespace

std::span<const Setting> all_settings() { return kSettings; }

std::string Setting::variable() const {
  std::string name = "CRADLE_";
  for (const char c : key) name += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return name;
}

std::string Setting::flag() const {
  if (key == "rate_hz") return "--rate";
  std::string name = "--" + std::string(key);
  std::replace(name.begin(), name.end(), '_', '-');
  return name;
}

std::string value_text(const Setting& setting, const Config& config) {
  return std::visit(
      [&](auto field) -> std::string {
        const auto& value = config.*field;
        using Value = std::remove_cvref_t<decltype(value)>;
        if constexpr (std::is_same_v<Value, bool>) {
          return value ? "true" : "false";
        } else if constexpr (std::is_same_v<Value, std::string>) {
          std::ostringstream text;
          const toml::value<std::string> node(value);  // quotes, and escapes what must be
          text << toml::toml_formatter(node, toml::format_flags::allow_unicode_strings);
          return text.str();
        } else {
          std::array<char, 32> digits{};
          const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value);
          return {digits.data(), end.ptr};
        }
      },
      setting.field);
}

Scene first_scene(const Config& config) {
  Scene scene = config.scene.empty() ? Scene{} : load_scene(config.scene);
  if (config.rate_hz > 0) scene.settings.rate_hz = config.rate_hz;
  scene.settings.bodies_max = config.bodies_max;
  scene.settings.wrenches_max = config.wrenches_max;
  return scene;
}

}  // namespace cradle
