// The daemon under a service manager: what it tells through NOTIFY_SOCKET, what SIGHUP reloads.
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstddef>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>

#include "tests/integration/daemon.h"

namespace cradle {
namespace {

using namespace std::chrono_literals;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

constexpr auto kPatience = 20s;
constexpr auto kWatchdogPeriod = 400ms;

/// A folder of its own, for as long as the object lives.
class ServiceFolder {
 public:
  ServiceFolder() : path_(new_folder()) {}
  ~ServiceFolder() { std::filesystem::remove_all(path_); }
  ServiceFolder(const ServiceFolder&) = delete;
  ServiceFolder& operator=(const ServiceFolder&) = delete;

  std::string file(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// The service manager's end of the socket, and its environment for what is started from here on.
class Manager {
 public:
  /// `name`: a path, or '@' and an abstract name.
  explicit Manager(const std::string& name) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    REQUIRE(name.size() < sizeof address.sun_path);
    std::memcpy(address.sun_path, name.data(), name.size());
    if (name[0] == '@') address.sun_path[0] = 0;
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
    REQUIRE(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), size) == 0);
    ::setenv("NOTIFY_SOCKET", name.c_str(), 1);
    ::setenv("WATCHDOG_USEC",
             std::to_string(std::chrono::microseconds(kWatchdogPeriod).count()).c_str(), 1);
  }
  ~Manager() {
    ::close(socket_);
    ::unsetenv("NOTIFY_SOCKET");
    ::unsetenv("WATCHDOG_USEC");
  }
  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;

  /// The next message, or empty if none comes in time.
  std::string receive(std::chrono::milliseconds timeout) const {
    pollfd descriptor{socket_, POLLIN, 0};
    if (::poll(&descriptor, 1, static_cast<int>(timeout.count())) != 1) return {};
    char text[4096];
    const auto size = ::recv(socket_, text, sizeof text, 0);
    return {text, static_cast<std::size_t>(std::max<ssize_t>(size, 0))};
  }

  /// The next message that begins like this, past others; empty if none comes.
  std::string wait_for(const std::string& begin) const {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < deadline) {
      const std::string message = receive(100ms);
      if (message.starts_with(begin)) return message;
    }
    return {};
  }

  /// True if nothing comes during several periods of the watchdog, but for what is on its way.
  bool is_silent() const {
    while (!receive(kWatchdogPeriod / 2).empty()) {
    }
    return receive(3 * kWatchdogPeriod).empty();
  }

 private:
  int socket_ = -1;
};

std::string abstract_name() { return "@cradle-test-" + std::to_string(::getpid()); }

std::int64_t monotonic_us() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000 + now.tv_nsec / 1000;
}

/// True if `file` comes to contain the text.
bool comes_to_say(const Process& daemon, const std::string& text) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (daemon.errors().find(text) == std::string::npos) {
    if (std::chrono::steady_clock::now() >= deadline) return false;
    ::usleep(5000);
  }
  return true;
}

}  // namespace

TEST_CASE("a service manager is told of start, state, life, reload and end") {
  const ServiceFolder folder;
  for (const std::string& name : {folder.file("notify"), abstract_name()}) {
    CAPTURE(name);
    const Manager manager(name);
    Process daemon(serve_arguments({"--scene", CRADLE_SCENE_DIR "/demo.toml"}));
    // The first status comes with the start, and what says it serves, does.
    CHECK_THAT(manager.receive(kPatience), StartsWith("STATUS=world test: tick "));
    CHECK(manager.receive(kPatience) == "READY=1");
    REQUIRE(connect(5s));
    CHECK_THAT(manager.wait_for("STATUS=world test: tick "),
               Contains(" bodies, real-time factor ") && Contains(" clients"));
    for (int i = 0; i < 3; ++i) CHECK(manager.wait_for("WATCHDOG") == "WATCHDOG=1");

    const std::int64_t before = monotonic_us();
    daemon.signal(SIGHUP);
    const std::string mark = "RELOADING=1\nMONOTONIC_USEC=";
    const std::string reloading = manager.wait_for("RELOADING");
    REQUIRE_THAT(reloading, StartsWith(mark));
    const std::int64_t when = std::stoll(reloading.substr(mark.size()));
    CHECK(when >= before);
    CHECK(when <= monotonic_us());
    CHECK(manager.wait_for("READY") == "READY=1");

    daemon.signal(SIGTERM);
    CHECK(manager.wait_for("STOPPING") == "STOPPING=1");
    CHECK(daemon.wait(5s).value_or(-1) == 0);
  }
}

TEST_CASE("a client's shutdown is told to the service manager, too") {
  const Manager manager(abstract_name());
  Process daemon(serve_arguments({"--allow-shutdown"}));
  const auto client = connect();
  REQUIRE(client);
  client->wait(client->shutdown(), 5s);
  CHECK(manager.wait_for("STOPPING") == "STOPPING=1");
  CHECK(daemon.wait(5s).value_or(-1) == 0);
}

TEST_CASE("a world that stands still is alive for the watchdog") {
  const Manager manager(abstract_name());
  {
    const Process daemon(serve_arguments({"--lockstep", "--rate", "1"}));
    for (int i = 0; i < 4; ++i) CHECK(manager.wait_for("WATCHDOG") == "WATCHDOG=1");
    CHECK_THAT(manager.wait_for("STATUS=world test: tick 0, "), Contains("lockstep"));
  }
  const Process daemon(serve_arguments());
  const auto client = connect();
  REQUIRE(client);
  REQUIRE(client->wait(client->pause(), 5s));
  while (!manager.receive(0ms).empty()) {
  }
  for (int i = 0; i < 4; ++i) CHECK(manager.wait_for("WATCHDOG") == "WATCHDOG=1");
  CHECK_THAT(manager.wait_for("STATUS="), Contains("paused"));
}

TEST_CASE("a daemon that is stopped tells the watchdog nothing, and goes on when it does") {
  const Manager manager(abstract_name());
  const Process daemon(serve_arguments());
  REQUIRE(manager.wait_for("WATCHDOG") == "WATCHDOG=1");
  daemon.signal(SIGSTOP);
  CHECK(manager.is_silent());
  daemon.signal(SIGCONT);
  CHECK(manager.wait_for("WATCHDOG") == "WATCHDOG=1");
}

TEST_CASE("a daemon whose loop hangs tells the watchdog nothing though its other threads run") {
  const Manager manager(abstract_name());
  const Process daemon(serve_arguments());
  REQUIRE(manager.wait_for("WATCHDOG") == "WATCHDOG=1");
  // The loop is the process's first thread: a debugger holds that one alone.
  if (::ptrace(PTRACE_SEIZE, daemon.id(), nullptr, nullptr) != 0) {
    WARN("no tracing of processes here");
    return;
  }
  REQUIRE(::ptrace(PTRACE_INTERRUPT, daemon.id(), nullptr, nullptr) == 0);
  int status = 0;
  REQUIRE(::waitpid(daemon.id(), &status, __WALL) == daemon.id());
  REQUIRE(WIFSTOPPED(status));
  CHECK(manager.is_silent());
  REQUIRE(::ptrace(PTRACE_DETACH, daemon.id(), nullptr, nullptr) == 0);
  CHECK(manager.wait_for("WATCHDOG") == "WATCHDOG=1");
}

TEST_CASE("without a service manager, or with one that does not watch, nothing is different") {
  {
    const Manager manager(abstract_name());
    ::unsetenv("WATCHDOG_USEC");
    const Process daemon(serve_arguments());
    CHECK(manager.wait_for("READY") == "READY=1");
    CHECK_THAT(manager.wait_for("STATUS="), Contains("tick"));
  }
  Process daemon(serve_arguments());
  REQUIRE(connect());
  daemon.signal(SIGTERM);
  CHECK(daemon.wait(5s).value_or(-1) == 0);
}

TEST_CASE("a service manager that does not listen holds up nothing, and is complained of") {
  {
    const Manager manager(abstract_name());
    ::setenv("WATCHDOG_USEC", "4000", 1);  // a thousand messages a second, and nobody reads them
    const Process daemon(serve_arguments());
    const auto client = connect();
    REQUIRE(client);
    CHECK(comes_to_say(daemon, "the service manager cannot be told: Resource temporarily"));
    const Tick now = client->status().tick;
    CHECK(poll_until(*client, [&] { return client->status().tick > now + 60; }));
    // What it must know is said again when it listens: READY after the start, and after this.
    daemon.signal(SIGHUP);
    REQUIRE(comes_to_say(daemon, "configuration reloaded"));
    for (int i = 0; i < 2; ++i) CHECK(manager.wait_for("READY") == "READY=1");
  }
  ::setenv("NOTIFY_SOCKET", "/no/such/socket", 1);
  {
    const Process daemon(serve_arguments());
    REQUIRE(connect());
    CHECK(comes_to_say(daemon, "the service manager cannot be told: No such file or directory"));
  }
  ::unsetenv("NOTIFY_SOCKET");
}

TEST_CASE("SIGHUP takes over what may change in a running world, and names what may not") {
  const ServiceFolder folder;
  const std::string file = folder.file("cradled.toml");
  std::ofstream(file) << "threads = 1\n";
  Process daemon(serve_arguments({"--config", file}));
  const auto client = connect();
  REQUIRE(client);
  CHECK(client->wait(client->shutdown(), 5s).result == Result::not_allowed);

  // A flag is stronger than the file, before and after: `world` has not changed.
  std::ofstream(file) << "threads = 2\nrate_hz = 30\nworld = 'other'\nallow_control = false\n";
  daemon.signal(SIGHUP);
  REQUIRE(comes_to_say(daemon, "configuration reloaded, 1 changes"));
  CHECK_THAT(daemon.errors(), Contains("threads = 2 needs a restart, still 1 (" + file + ":1)"));
  CHECK_THAT(daemon.errors(), Contains("rate_hz = 30 needs a restart, still 0 (" + file + ":2)"));
  CHECK_THAT(daemon.errors(), Contains("allow_control = false, was true (" + file + ":4)"));
  CHECK_THAT(daemon.errors(), !Contains("\"other\""));
  CHECK(client->wait(client->pause(), 5s).result == Result::not_allowed);
  CHECK(poll_until(*client, [&] { return !client->status().controllable; }));
  CHECK(client->status().rate_hz == 60);

  // One fault, and all stays as it was.
  std::ofstream(file) << "allow_shutdown = true\nallow_contrl = true\n";
  daemon.signal(SIGHUP);
  REQUIRE(
      comes_to_say(daemon, "nothing reloaded: " + file +
                               ":2: unknown key 'allow_contrl'; did you mean 'allow_control'?"));
  CHECK(client->wait(client->shutdown(), 5s).result == Result::not_allowed);
  CHECK(client->wait(client->pause(), 5s).result == Result::not_allowed);
  std::filesystem::remove(file);
  daemon.signal(SIGHUP);
  REQUIRE(comes_to_say(daemon, "nothing reloaded: " + file + ": No such file"));
  REQUIRE(::mkfifo(file.c_str(), 0600) == 0);  // opening one would wait for a writer
  daemon.signal(SIGHUP);
  REQUIRE(comes_to_say(daemon, "nothing reloaded: " + file + ": Invalid argument"));
  std::filesystem::remove(file);
  CHECK(client->wait(client->pause(), 5s).result == Result::not_allowed);

  // The log's level, too: whoever comes from now on is not told of.
  std::ofstream(file) << "log_level = 'error'\nallow_shutdown = true\n";
  daemon.signal(SIGHUP);
  REQUIRE(poll_until(*client, [&] { return client->status().controllable; }));
  const auto hellos = [&] {
    const std::string log = daemon.errors();
    int count = 0;
    for (std::size_t at = 0; (at = log.find("said hello", at)) != std::string::npos; ++at) ++count;
    return count;
  };
  CHECK(hellos() == 1);
  const auto second = connect();
  REQUIRE(second);
  CHECK(second->wait(second->shutdown(), 5s));
  CHECK(daemon.wait(5s).value_or(-1) == 0);
  CHECK(hellos() == 1);
}

}  // namespace cradle
