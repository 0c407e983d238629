// What the daemon writes on standard error.
#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/integration/daemon.h"
#include "tests/integration/http.h"

namespace cradle {
namespace {

using namespace std::chrono_literals;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

int lines_with(const std::string& text, const std::string& part) {
  const auto lines = lines_of(text);
  return static_cast<int>(std::count_if(lines.begin(), lines.end(), [&](const std::string& line) {
    return line.find(part) != std::string::npos;
  }));
}

std::unique_ptr<Client> connect_as(const std::string& name) {
  ClientOptions options;
  options.lcm_url = own_url();
  options.world = "test";
  options.name = name;
  return Client::connect(options, 20s).client;
}

/// Makes bodies and throws them all beyond the limits: each is quarantined in the next tick.
void throw_away(Client& client, int count) {
  std::vector<BodySpec> specs;
  for (int i = 0; i < count; ++i) {
    specs.push_back(ball_spec({0, 0, 3.0 * i}));
    specs.back().name = "doomed " + std::to_string(i);
  }
  const Answer made = client.wait(client.spawn(specs), 20s);
  REQUIRE(made);
  std::vector<Wrench> pushes(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    pushes[static_cast<std::size_t>(i)].body = {made.body.value + i};
    pushes[static_cast<std::size_t>(i)].value = {1e15, 0, 0};
  }
  REQUIRE(client.wait(client.push(pushes), 20s));
  REQUIRE(poll_until(client, [&] { return client.status().quarantined == count; }));
}

/// A daemon that writes its log into `pipe`.
std::function<int()> serve_into(int pipe, std::vector<std::string> arguments) {
  return [pipe, arguments]() mutable {
    ::signal(SIGPIPE, SIG_DFL);
    ::dup2(pipe, STDERR_FILENO);
    arguments[0] = CRADLE_BIN_DIR "/cradled";
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    ::execv(pointers[0], pointers.data());
    return 127;
  };
}

}  // namespace

TEST_CASE("the log as JSON is an object a line, with names as the clients gave them") {
  Process daemon(serve_arguments({"--log-format", "json"}));
  const std::string name = "say \"\\ \u202eKäthe";
  const auto client = connect_as(name);
  REQUIRE(client);
  throw_away(*client, 2);
  daemon.signal(SIGTERM);
  REQUIRE(daemon.wait(10s).value_or(-1) == 0);
  std::map<std::string, nlohmann::json> by_message;
  for (const std::string& line : lines_of(daemon.errors())) {
    CAPTURE(line);
    const auto object = nlohmann::json::parse(line, nullptr, false);
    REQUIRE(object.is_object());
    CHECK(object.at("time").get<std::string>().size() == 24);
    by_message[object.at("message")] = object;
  }
  CHECK(by_message.at("world begins").at("world") == "test");
  CHECK(by_message.at("client said hello").at("client") == name);
  CHECK(by_message.at("client said hello").at("level") == "info");
  CHECK(by_message.at("body quarantined").at("name") == "doomed 1");
  CHECK(by_message.at("body quarantined").at("body") == 2);
  CHECK(by_message.at("body quarantined").at("level") == "warning");
  CHECK(by_message.at("world ended").at("tick") > 0);
}

TEST_CASE("the log as text shows what a terminal would obey instead of sending it") {
  Process daemon(serve_arguments());
  REQUIRE(connect_as("\u202eKäthe"));
  daemon.signal(SIGTERM);
  REQUIRE(daemon.wait(10s).value_or(-1) == 0);
  CAPTURE(daemon.errors());
  CHECK(lines_with(daemon.errors(), R"(info client said hello client="\u{202e}Käthe")") == 1);
}

TEST_CASE("what repeats itself in the log is cut short and counted, place by place") {
  Process daemon(serve_arguments({"--metrics", "127.0.0.1:" + std::to_string(own_tcp_port())}));
  const auto client = connect();
  REQUIRE(client);
  throw_away(*client, 30);
  REQUIRE(connect_as("the late one"));
  REQUIRE(poll_until(*client, [] {
    return scrape(own_tcp_port())
               .find("cradle_log_lines_dropped_total{reason=\"repeated\"} 20\n") !=
           std::string::npos;
  }));
  daemon.signal(SIGTERM);
  REQUIRE(daemon.wait(10s).value_or(-1) == 0);
  CAPTURE(daemon.errors());
  CHECK(lines_with(daemon.errors(), "warning body quarantined") == 10);
  CHECK(lines_with(daemon.errors(), "warning 20 more like this like=\"body quarantined\"") == 1);
  CHECK(lines_with(daemon.errors(), "the late one") == 1);
}

TEST_CASE("a log that nobody reads stops neither the world nor its end, and says what it lost") {
  int ends[2];
  REQUIRE(::pipe2(ends, O_NONBLOCK | O_CLOEXEC) == 0);
  ::fcntl(ends[0], F_SETPIPE_SZ, 4096);
  const std::string filling(4096, '\n');
  while (::write(ends[1], filling.data(), filling.size()) > 0) {
  }
  while (::write(ends[1], "\n", 1) > 0) {
  }
  ::fcntl(ends[1], F_SETFL, 0);  // the daemon finds a pipe that blocks
  Process daemon(serve_into(
      ends[1], serve_arguments({"--metrics", "127.0.0.1:" + std::to_string(own_tcp_port())})));
  const auto client = connect();  // whose hello would be logged
  REQUIRE(client);
  throw_away(*client, 3);
  const Tick now = client->tick();
  REQUIRE(poll_until(*client, [&] { return client->tick() > now + 10; }));
  REQUIRE(poll_until(*client, [] {  // begin, hello, three quarantines
    return scrape(own_tcp_port())
               .find("cradle_log_lines_dropped_total{reason=\"stderr_full\"} 5\n") !=
           std::string::npos;
  }));

  SECTION("there is room again") {
    char bytes[8192];
    while (::read(ends[0], bytes, sizeof bytes) == sizeof bytes) {
    }
    REQUIRE(connect_as("the late one"));
    daemon.signal(SIGTERM);
    CHECK(daemon.wait(10s).value_or(-1) == 0);
    const ssize_t count = ::read(ends[0], bytes, sizeof bytes);
    REQUIRE(count > 0);
    const std::string text(bytes, static_cast<std::size_t>(count));
    CAPTURE(text);
    CHECK(lines_with(text, "log lines lost: standard error took no more count=5") == 1);
    CHECK(lines_with(text, "the late one") == 1);
  }
  SECTION("there is not") {
    daemon.signal(SIGTERM);
    CHECK(daemon.wait(10s).value_or(-1) == 0);
  }
  ::close(ends[0]);
  ::close(ends[1]);
}

TEST_CASE("the daemon lives on when the reader of its log has gone") {
  int ends[2];
  REQUIRE(::pipe2(ends, O_CLOEXEC) == 0);
  Process daemon(serve_into(ends[1], serve_arguments()));
  const auto client = connect();
  REQUIRE(client);
  ::close(ends[0]);
  ::close(ends[1]);
  throw_away(*client, 3);
  CHECK(daemon.is_running());
  daemon.signal(SIGTERM);
  CHECK(daemon.wait(10s).value_or(-1) == 0);
}

}  // namespace cradle
