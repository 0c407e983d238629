// `cradled serve` as a process: network, signals, log.
#include <cradle/limits.h>
#include <signal.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "protocol/transport/lcm_transport.h"
#include "server/daemon.h"
#include "server/exit_code.h"
#include "server/world_lock.h"

namespace cradle {
namespace {

/// SIGTERM and SIGINT as a descriptor; the threads started later inherit the block.
class StopSignals {
 public:
  StopSignals() {
    sigemptyset(&set_);
    sigaddset(&set_, SIGTERM);
    sigaddset(&set_, SIGINT);
    pthread_sigmask(SIG_BLOCK, &set_, &old_);
    descriptor_ = ::signalfd(-1, &set_, SFD_CLOEXEC | SFD_NONBLOCK);
  }
  ~StopSignals() {
    signalfd_siginfo taken;  // what has come is answered; left pending, it would end us below
    while (::read(descriptor_, &taken, sizeof taken) > 0) {
    }
    ::close(descriptor_);
    pthread_sigmask(SIG_SETMASK, &old_, nullptr);  // a second signal ends the process at once
  }
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  int descriptor() const { return descriptor_; }

 private:
  sigset_t set_{};
  sigset_t old_{};
  int descriptor_ = -1;
};

std::unique_ptr<Transport> open(const LcmUrl& url, Lane lane) {
  OpenedTransport opened = open_lcm_transport(url, lane);
  if (!opened.transport) throw StartupError(kExitNoNetwork, opened.message);
  return std::move(opened.transport);
}

void set_up_log(const std::string& level) {
  auto logger = spdlog::stderr_color_mt("cradled");
  logger->set_pattern("%Y-%m-%dT%H:%M:%S.%eZ %^%l%$ %v", spdlog::pattern_time_type::utc);
  spdlog::set_default_logger(logger);
  spdlog::set_level(spdlog::level::from_str(level));
}

[[noreturn]] void refuse_taken(const std::string& world, const LcmUrl& url, const char* where) {
  throw StartupError(
      kExitTaken, "another daemon serves world \"" + world + "\" at " + url.text() + ' ' + where);
}

}  // namespace

int run_daemon(const Config& config) {
  set_up_log(config.log_level);
  const auto url = parse_lcm_url(config.lcm_url);
  if (!url) throw StartupError(kExitUsage, "not an LCM URL like " + LcmUrl().text());

  Scene scene = config.scene.empty() ? Scene{} : load_scene(config.scene);
  if (config.rate_hz > 0) scene.settings.rate_hz = config.rate_hz;
  scene.settings.bodies_max = config.bodies_max;
  scene.settings.wrenches_max = config.wrenches_max;

  Daemon::Options options;
  options.world = config.world;
  options.lockstep = config.lockstep;
  options.permissions = {config.allow_control, config.allow_shutdown};
  options.datagram_bytes = config.datagram_bytes;
  if (options.datagram_bytes == 0) {
    options.datagram_bytes =
        url->ttl == 0 ? limits::kLoopbackDatagramBytes : limits::kNetworkDatagramBytes;
  }
  options.state_port = url->state_lane().port;
  options.threads = config.threads;

  const StopSignals stop;
  const WorldLock lock(options.world, url->port);
  if (!lock.is_held()) refuse_taken(options.world, *url, "on this host");
  auto control = open(*url, Lane::send_and_receive);
  auto states = open(url->state_lane(), Lane::send_only);
  Daemon daemon(options, std::move(scene), std::move(control), std::move(states));
  const auto presence = daemon.look_around(url->ttl > 0);
  if (presence.has_rival) refuse_taken(options.world, *url, "on this network");
  if (!presence.hears_itself) {
    throw StartupError(kExitNoNetwork,
                       "own multicast does not come back on " + url->text() +
                           "; for this host alone type: ip route add 224.0.0.0/4 dev lo");
  }
  spdlog::info("world \"{}\" on {}: {} bodies at {} Hz{}, epoch {}", options.world, url->text(),
               daemon.world().body_count(), daemon.world().settings().rate_hz,
               options.lockstep ? " in lockstep" : "", daemon.epoch());
  daemon.run(stop.descriptor());
  spdlog::info("world \"{}\" ended at tick {}", options.world, daemon.world().tick());
  return 0;
}

}  // namespace cradle
