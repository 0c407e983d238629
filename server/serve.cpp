#include "server/serve.h"

#include <cradle/limits.h>
#include <signal.h>
#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>

#include "protocol/transport/lcm_transport.h"
#include "server/daemon.h"
#include "server/exit_code.h"
#include "server/large_pages.h"
#include "server/log.h"
#include "server/metrics_page.h"
#include "server/service_manager.h"
#include "server/world_lock.h"

namespace cradle {
namespace {

/// SIGTERM, SIGINT and SIGHUP as a descriptor; the threads started later inherit the block.
class Signals {
 public:
  Signals() {
    sigemptyset(&set_);
    for (const int number : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&set_, number);
    pthread_sigmask(SIG_BLOCK, &set_, &old_);
    descriptor_ = ::signalfd(-1, &set_, SFD_CLOEXEC | SFD_NONBLOCK);
  }
  ~Signals() {
    while (take() != 0) {  // what has come is answered; left pending, it would end us below
    }
    ::close(descriptor_);
    pthread_sigmask(SIG_SETMASK, &old_, nullptr);  // a second signal ends the process at once
  }
  Signals(const Signals&) = delete;
  Signals& operator=(const Signals&) = delete;

  int descriptor() const { return descriptor_; }

  /// The number of one that has come, or 0.
  int take() {
    signalfd_siginfo taken{};
    return ::read(descriptor_, &taken, sizeof taken) > 0 ? static_cast<int>(taken.ssi_signo) : 0;
  }

 private:
  sigset_t set_{};
  sigset_t old_{};
  int descriptor_ = -1;
};

Permissions permissions(const Config& config) {
  return {config.allow_control, config.allow_shutdown};
}

/// Ends the daemon on a signal, reloads its configuration on another, and keeps systemd informed.
class Process final : public Supervisor {
 public:
  Process(Daemon& daemon, Signals& signals, const ConfigSources& sources, LoadedConfig& config)
      : daemon_(daemon), signals_(signals), sources_(sources), config_(config) {
    for (const int descriptor : {signals_.descriptor(), manager_.watchdog_descriptor()}) {
      if (descriptor < 0) continue;
      epoll_event wanted{};
      wanted.events = EPOLLIN;
      ::epoll_ctl(descriptor_, EPOLL_CTL_ADD, descriptor, &wanted);
    }
  }
  ~Process() override { ::close(descriptor_); }

  int descriptor() const override { return descriptor_; }

  bool attend() override {
    manager_.watched();
    while (const int number = signals_.take()) {
      if (number != SIGHUP) return false;
      manager_.reloading();
      reload();
      is_ready_told_ = false;  // with the next status
    }
    return true;
  }

  void heartbeat(const WorldStatus& status) override {
    manager_.status(status);
    if (!is_ready_told_) is_ready_told_ = manager_.ready();  // or with the next one
    const int error = manager_.error();
    if (error != 0 && error != error_told_) {
      write_log(LogLevel::warn,
                std::string("the service manager cannot be told: ") + std::strerror(error));
    }
    error_told_ = error;
  }

  void stopping() { manager_.stopping(); }

 private:
  void reload();

  Daemon& daemon_;
  Signals& signals_;
  const ConfigSources& sources_;
  LoadedConfig& config_;  ///< that the daemon runs with
  ServiceManager manager_;
  int descriptor_ = ::epoll_create1(EPOLL_CLOEXEC);
  bool is_ready_told_ = false;
  int error_told_ = 0;  ///< why the manager could not be told
};

void tell_nothing(const std::string& why) {
  write_log(LogLevel::error, "nothing reloaded: " + why);
}

/// Takes over what may change in a running world, and names the rest. A configuration with a fault
/// changes nothing.
void Process::reload() {
  LoadedConfig wanted;
  try {
    wanted = load_config(sources_);
  } catch (const std::filesystem::filesystem_error& error) {
    return tell_nothing(error.path1().string() + ": " + error.code().message());
  } catch (const std::exception& error) {  // the daemon goes on, whatever is in the files now
    return tell_nothing(error.what());
  }
  int changes = 0;
  for (const Setting& setting : all_settings()) {
    const std::string key(setting.key);
    const std::string now = value_text(setting, config_.values);
    const std::string then = value_text(setting, wanted.values);
    if (now == then) continue;
    const std::string origin = wanted.origins.at(setting.key).text();
    if (setting.is_reloadable) {
      std::visit([&](auto field) { config_.values.*field = wanted.values.*field; }, setting.field);
      write_log(LogLevel::info, key + " = " + then + ", was " + now + " (" + origin + ")");
      ++changes;
    } else {
      write_log(LogLevel::warn,
                key + " = " + then + " needs a restart, still " + now + " (" + origin + ")");
    }
  }
  daemon_.set_permissions(permissions(config_.values));
  set_log_level(config_.values.log_level);
  write_log(LogLevel::info, "configuration reloaded, " + std::to_string(changes) + " changes");
}

std::unique_ptr<Transport> open(const LcmUrl& url, Lane lane) {
  OpenedTransport opened = open_lcm_transport(url, lane);
  if (!opened.transport) throw StartupError(kExitNoNetwork, opened.message);
  return std::move(opened.transport);
}

Daemon::Options daemon_options(const Config& config, const LcmUrl& url) {
  Daemon::Options options;
  options.world = config.world;
  options.lockstep = config.lockstep;
  options.permissions = permissions(config);
  options.datagram_bytes =
      config.datagram_bytes != 0 ? config.datagram_bytes : default_datagram_bytes(url);
  options.state_port = url.state_lane().port;
  options.threads = config.threads;
  return options;
}

[[noreturn]] void refuse_taken(const std::string& world, const LcmUrl& url, const char* where) {
  throw StartupError(
      kExitTaken, "another daemon serves world \"" + world + "\" at " + url.text() + ' ' + where);
}

/// None if `address` is empty.
std::unique_ptr<MetricsPage> open_page(const std::string& address, const ReadingsBoard& board) {
  if (address.empty()) return nullptr;
  try {
    return std::make_unique<MetricsPage>(*parse_page_address(address),
                                         [&board] { return board.read(metrics_text); });
  } catch (const PageError& error) {
    throw StartupError(kExitNoNetwork, error.what());
  }
}

}  // namespace

int run_daemon(const ConfigSources& sources) {
  LoadedConfig loaded = load_config(sources);
  const Config& config = loaded.values;
  set_up_log(config.log_level, config.log_format == "json" ? LogFormat::json : LogFormat::text);
  const LcmUrl url = *parse_lcm_url(config.lcm_url);
  Daemon::Options options = daemon_options(config, url);
  ReadingsBoard board;
  if (!config.metrics.empty()) options.board = &board;
  Signals signals;  // from here on they are answered by the loop, when it has begun
  Scene scene = first_scene(config);

  const WorldLock lock(options.world, url.group, url.port);
  if (!lock.is_held()) refuse_taken(options.world, url, "on this host");
  if (!take_memory(static_cast<std::size_t>(config.memory_mib) << 20)) {
    write_log(LogLevel::warn, "there is less memory than memory_mib, so none is taken");
  }
  auto control = open(url, Lane::send_and_receive);
  auto states = open(url.state_lane(), Lane::send_only);
  Daemon daemon(options, std::move(scene), std::move(control), std::move(states));
  const auto presence = daemon.look_around(url.ttl > 0);
  if (presence.has_rival) refuse_taken(options.world, url, "on this network");
  if (!presence.hears_itself) {
    throw StartupError(kExitNoNetwork,
                       "own multicast does not come back on " + url.text() +
                           "; for this host alone type: ip route add 224.0.0.0/4 dev lo");
  }
  const auto page = open_page(config.metrics, board);
  write_log(LogLevel::info, "world begins",
            {{"world", options.world},
             {"url", url.text()},
             {"bodies", daemon.world().body_count()},
             {"rate_hz", daemon.world().settings().rate_hz},
             {"mode", options.lockstep ? "lockstep" : "real time"},
             {"epoch", daemon.epoch()}});
  Process process(daemon, signals, sources, loaded);
  daemon.run(process);
  process.stopping();
  write_log(LogLevel::info, "world ended",
            {{"world", options.world}, {"tick", daemon.world().tick()}});
  return kExitOk;
}

}  // namespace cradle
