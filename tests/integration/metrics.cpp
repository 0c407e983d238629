// The metrics page of a real daemon: what clients did is what it says.
#include <arpa/inet.h>
#include <cradle/version.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "protocol/codec.h"
#include "protocol/transport/lcm_url.h"
#include "tests/integration/daemon.h"
#include "tests/integration/http.h"
#include "tests/unit/exposition.h"

namespace cradle {
namespace {

using namespace std::chrono_literals;

std::vector<std::string> with_metrics(std::vector<std::string> more = {}) {
  more.push_back("--metrics");
  more.push_back("127.0.0.1:" + std::to_string(own_tcp_port()));
  return serve_arguments(more);
}

std::map<std::string, double> samples() {
  const Exposition page = read_exposition(scrape(own_tcp_port()));
  CHECK(page.faults == std::vector<std::string>{});
  return page.samples;
}

/// The local addresses on which a process listens for TCP, as /proc writes them.
std::vector<std::string> listening(int process) {
  const std::string folder = "/proc/" + std::to_string(process);
  std::set<std::string> sockets;
  for (const auto& entry : std::filesystem::directory_iterator(folder + "/fd")) {
    std::error_code ignored;
    sockets.insert(std::filesystem::read_symlink(entry.path(), ignored).string());
  }
  std::vector<std::string> found;
  for (const char* table : {"/net/tcp", "/net/tcp6"}) {
    std::ifstream lines(folder + table);
    std::string line;
    std::getline(lines, line);
    while (std::getline(lines, line)) {
      std::istringstream fields(line);
      std::vector<std::string> field(10);
      for (std::string& f : field) fields >> f;
      const bool is_listening = field[3] == "0A";
      if (is_listening && sockets.contains("socket:[" + field[9] + "]")) found.push_back(field[1]);
    }
  }
  return found;
}

/// Sends `count` copies of a datagram to the port of commands.
void send_raw(const std::string& datagram, int count) {
  const LcmUrl url = *parse_lcm_url(own_url());
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(url.port));
  ::inet_pton(AF_INET, url.group.c_str(), &address.sin_addr);
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  for (int i = 0; i < count; ++i) {
    ::sendto(socket, datagram.data(), datagram.size(), 0,
             reinterpret_cast<const sockaddr*>(&address), sizeof address);
  }
  ::close(socket);
}

std::string lcm_message(const std::string& channel, const std::string& payload,
                        const std::string& magic = "LC02") {
  return magic + std::string("\0\0\0\1", 4) + channel + '\0' + payload;
}

std::string of_type(MessageKind kind, const std::string& payload) {
  return lcm_message(Channels("test").name(kind), payload);
}

}  // namespace

TEST_CASE("without being told to, the daemon listens on no TCP port") {
  const Process daemon(serve_arguments());
  REQUIRE(connect());
  CHECK(listening(daemon.id()).empty());
  CHECK(scrape(own_tcp_port()).empty());
}

TEST_CASE("metrics are served on loopback alone") {
  const Process daemon(with_metrics());
  REQUIRE(connect());
  const auto found = listening(daemon.id());
  REQUIRE(found.size() == 1);
  CHECK(found[0].starts_with("0100007F:"));  // 127.0.0.1
}

TEST_CASE("an address that is not of loopback, or that somebody has, ends the start with a line") {
  for (const char* address : {"0.0.0.0:9464", "192.0.2.1:9464", "localhost:9464", "9464"}) {
    const Finished finished = run(serve_arguments({"--metrics", address}), 10s);
    CAPTURE(address, finished.errors);
    CHECK(finished.exit_code == 64);
    CHECK(line_count(finished.errors) == 1);
    CHECK(finished.errors.find(address) != std::string::npos);
  }
  const Process first(with_metrics());
  REQUIRE(connect());
  auto of_another_world = with_metrics();
  of_another_world[3] = "other";
  const Finished second = run(of_another_world, 20s);
  CAPTURE(second.errors);
  CHECK(second.exit_code == 69);
  CHECK(line_count(second.errors) == 1);
  CHECK(second.errors.find("127.0.0.1 port " + std::to_string(own_tcp_port())) !=
        std::string::npos);
}

TEST_CASE("metrics say what clients did") {
  const Process daemon(with_metrics({"--lockstep"}));
  const auto client = connect();
  REQUIRE(client);
  REQUIRE(client->wait(client->set_gravity({}), 20s));
  BodySpec floor;
  floor.kind = BodyKind::fixed;
  floor.shape = Shape::half_space();
  BodySpec resting = ball_spec({0, 0, 0.499});
  resting.name = "resting";
  const std::vector<BodySpec> specs = {floor, resting, ball_spec({5, 0, 9}), ball_spec({9, 0, 9})};
  const Answer made = client->wait(client->spawn(specs), 20s);
  REQUIRE(made);
  const BodyId doomed{made.body.value + 3};
  CHECK(client->wait(client->spawn(resting), 20s).result == Result::duplicate_name);
  for (int i = 0; i < 3; ++i) {
    CHECK(client->wait(client->despawn(BodyId{1000}), 20s).result == Result::unknown_body);
  }
  Wrench push;
  push.body = made.body;
  CHECK(client->wait(client->push(push), 20s).result == Result::wrong_kind);  // the floor
  push.body = {made.body.value + 2};
  push.duration = WrenchDuration::until_cleared;
  push.value = {1, 0, 0};
  REQUIRE(client->wait(client->push(push), 20s));
  push.body = doomed;
  push.duration = WrenchDuration::this_tick;
  push.value = {1e15, 0, 0};
  REQUIRE(client->wait(client->push(push), 20s));
  const Ticket later = client->set_gravity({}, Client::at(5));
  REQUIRE(client->wait(client->step(7), 20s));
  REQUIRE(client->wait(later, 20s));

  std::map<std::string, double> page;
  REQUIRE(poll_until(*client, [&] {
    page = samples();
    return page["cradle_ticks_total"] == 7;
  }));
  const auto commands = [&](const char* result) {
    return page.at("cradle_commands_total{result=\"" + std::string(result) + "\"}");
  };
  CHECK(commands("ok") == 7);      // hello, gravity, spawn, two pushes, gravity later, step
  CHECK(commands("queued") == 2);  // gravity later, step
  CHECK(commands("duplicate_name") == 1);
  CHECK(commands("unknown_body") == 3);
  CHECK(commands("wrong_kind") == 1);
  CHECK(commands("late") == 0);
  CHECK(page.at("cradle_bodies") == 4);
  CHECK(page.at("cradle_bodies_awake") == 2);  // neither the floor nor the doomed
  CHECK(page.at("cradle_quarantines_total") == 1);
  CHECK(page.at("cradle_contacts") == 1);
  CHECK(page.at("cradle_bodies_crowded") == 0);
  CHECK(page.at("cradle_bodies_stopped_at_impact_total") == 0);
  CHECK(page.at("cradle_impacts_unresolved_total") == 0);
  CHECK(page.at("cradle_spins_cut_total") == 0);
  CHECK(page.at("cradle_ticks_in_halves_total") == 0);
  CHECK(page.at("cradle_islands_makeshift_total") == 0);
  CHECK(page.at("cradle_impacts_total") == 0);  // what fell rests on a soft contact by now
  CHECK(page.at("cradle_impacts_ordered_total") == 0);
  CHECK(page.at("cradle_impacts_spent_total") == 0);
  CHECK(page.at("cradle_wrenches") == 1);
  CHECK(page.at("cradle_clients") == 1);
  CHECK(page.at("cradle_tick_period_seconds") == 1.0 / 60);
  CHECK(page.at("cradle_world_info{world=\"test\"}") == 1);
  CHECK(page.at("cradle_build_info{version=\"" CRADLE_VERSION "\",protocol=\"" +
                std::to_string(kProtocolVersion) + "\"}") == 1);

  CHECK(page.at("cradle_tick_seconds_count") == 7);
  double parts_s = 0;
  for (const char* phase : {"apply", "collide", "solve", "publish"}) {
    const std::string label = "{phase=\"" + std::string(phase) + "\"}";
    CHECK(page.at("cradle_tick_phase_seconds_count" + label) == 7);
    CHECK(page.at("cradle_tick_phase_seconds_sum" + label) > 0);
    parts_s += page.at("cradle_tick_phase_seconds_sum" + label);
  }
  CHECK(page.at("cradle_tick_seconds_sum") == Approx(parts_s));

  const double chunks = page.at("cradle_chunks_sent_total");
  CHECK(chunks >= static_cast<double>(client->statistics().chunks_received));
  CHECK(chunks >= 7);
  CHECK(page.at("cradle_sent_bytes_total{port=\"states\"}") > 7 * 4 * 100);  // 7 ticks of 4 bodies
  CHECK(page.at("cradle_datagrams_sent_total{port=\"control\"}") > 7);
}

TEST_CASE("metrics tell rejected datagrams apart by reason") {
  const Process daemon(with_metrics());
  const auto client = connect();
  REQUIRE(client);
  const std::string gravity = [] {
    const Bytes bytes = encode(Command{{7, 1, 1, 0}, SetGravity{{}}});
    return std::string(bytes.begin(), bytes.end());
  }();
  std::string other_type = gravity;
  other_type[0] = static_cast<char>(other_type[0] ^ 1);
  const std::string no_count(11, '\0');
  const std::string bad_count(200, '\xff');
  send_raw("LC02", 2);
  send_raw(lcm_message("CRADLE_test_SPAWN", "payload", "LC01"), 3);
  send_raw(lcm_message("CRADLE_test_SPAWN", "payload", "LC03"), 4);
  send_raw(lcm_message(std::string(64, 'c'), "payload"), 5);
  send_raw(lcm_message("CRADLE_other_SPAWN", "payload"), 6);
  send_raw(of_type(MessageKind::spawn, no_count), 7);
  send_raw(of_type(MessageKind::despawn, bad_count), 8);
  send_raw(of_type(MessageKind::set_gravity, gravity + "?"), 9);
  send_raw(of_type(MessageKind::set_gravity, other_type), 10);
  send_raw(of_type(MessageKind::set_gravity, gravity), 11);  // fine, but of an unknown run

  std::map<std::string, double> page;
  const auto reason = [&](const char* name) {
    return page.at("cradle_datagrams_rejected_total{reason=\"" + std::string(name) + "\"}");
  };
  REQUIRE(poll_until(*client, [&] {
    page = samples();
    return page.at("cradle_commands_total{result=\"wrong_epoch\"}") == 11;
  }));
  CHECK(reason("too_short") == 2);
  CHECK(reason("bad_magic") == 3);
  CHECK(reason("fragment") == 4);
  CHECK(reason("bad_channel") == 5);
  CHECK(reason("unknown_channel") == 6);
  CHECK(reason("no_count") == 7);
  CHECK(reason("bad_count") == 8);
  CHECK(reason("wrong_size") == 9);
  CHECK(reason("malformed") == 10);
  CHECK(reason("too_long") == 0);
  // The heartbeat tells the sum.
  CHECK(poll_until(*client, [&] { return client->status().datagrams_rejected == 54; }));
}

TEST_CASE("metrics count every datagram that found no room") {
  const Process daemon(with_metrics());
  REQUIRE(connect());
  constexpr int kCount = 4000;
  daemon.signal(SIGSTOP);
  send_raw(lcm_message("CRADLE_other_SPAWN", std::string(4000, 'x')), kCount);
  daemon.signal(SIGCONT);
  // The kernel tells with the next datagram that finds room: one of the daemon's own heartbeats.
  // Some of those may have been lost as well.
  const auto client = connect();
  REQUIRE(client);
  std::map<std::string, double> page;
  const auto lost = [&] {
    return page.at("cradle_datagrams_dropped_total{reason=\"kernel_buffer\"}");
  };
  CHECK(poll_until(*client, [&] {
    page = samples();
    return lost() + page.at("cradle_datagrams_rejected_total{reason=\"unknown_channel\"}") >=
           kCount;
  }));
  CHECK(lost() > 0);
  CHECK(lost() < kCount);
}

TEST_CASE("readers of metrics that do nothing keep out neither others nor the world") {
  Process daemon(with_metrics());
  const auto client = connect();
  REQUIRE(client);
  std::vector<std::unique_ptr<TcpConnection>> idle;
  for (int i = 0; i < 40; ++i) {
    idle.push_back(std::make_unique<TcpConnection>(own_tcp_port()));
    REQUIRE(idle.back()->is_open());
    if (i % 3 == 1) idle.back()->send("GET /metr");
    if (i % 3 == 2) idle.back()->send("GET /metrics HTTP/1.1\r\n\r\n");  // and does not read
  }
  CHECK(!samples().empty());
  const Tick now = client->tick();
  CHECK(poll_until(*client, [&] { return client->tick() > now + 10; }));
  CHECK(!samples().empty());
  daemon.signal(SIGTERM);  // nor does one keep it from ending
  CHECK(daemon.wait(5s).value_or(-1) == 0);
}

TEST_CASE("the metrics page answers GET and HEAD of /metrics, and nothing else") {
  const Process daemon(with_metrics());
  REQUIRE(connect());
  const int port = own_tcp_port();
  const std::string good = http(port, "GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n");
  CHECK(good.starts_with("HTTP/1.1 200 OK\r\n"));
  CHECK(good.find("\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8\r\n") !=
        std::string::npos);
  CHECK(http(port, "GET /metrics?x=1 HTTP/1.0\r\n\r\n").starts_with("HTTP/1.1 200 OK\r\n"));
  const std::string head = http(port, "HEAD /metrics HTTP/1.1\r\nHost: x\r\n\r\n");
  CHECK(head.starts_with("HTTP/1.1 200 OK\r\n"));
  CHECK(head.ends_with("\r\n\r\n"));
  CHECK(http(port, "GET / HTTP/1.1\r\n\r\n").starts_with("HTTP/1.1 404 "));
  CHECK(http(port, "POST /metrics HTTP/1.1\r\n\r\n").starts_with("HTTP/1.1 405 "));
  CHECK(http(port, "nonsense\r\n\r\n").starts_with("HTTP/1.1 400 "));
  CHECK(http(port, std::string(1 << 20, 'x')).empty());  // no end: shut out
  CHECK(!samples().empty());
}

}  // namespace cradle
