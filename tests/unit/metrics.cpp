// The metrics page as text, its address, and the checker that all of it is checked with.
#include <catch2/catch.hpp>
#include <thread>

#include "server/metrics_page.h"
#include "server/readings.h"
#include "tests/unit/exposition.h"

namespace cradle {

TEST_CASE("the metrics page is Prometheus' text format and shows every reading") {
  Readings r;
  r.world = "arena";
  r.tick = 7;
  r.overruns = 2;
  r.bodies = 5;
  r.awake = 3;
  r.answers[static_cast<std::size_t>(Result::late)] = 4;
  r.control.count(DatagramFault::fragment);
  r.inbox.bad_count = 6;
  r.control.dropped_by_kernel = 8;
  r.states.sent = 9;
  r.chunks_overtaken = 10;
  r.log_lines_left_out = 11;
  const Exposition page = read_exposition(metrics_text(r));
  CHECK(page.faults == std::vector<std::string>{});
  const auto at = [&](const char* name) { return page.samples.at(name); };
  CHECK(at("cradle_world_info{world=\"arena\"}") == 1);
  CHECK(at("cradle_ticks_total") == 7);
  CHECK(at("cradle_tick_overruns_total") == 2);
  CHECK(at("cradle_bodies") == 5);
  CHECK(at("cradle_bodies_awake") == 3);
  CHECK(at("cradle_commands_total{result=\"late\"}") == 4);
  CHECK(at("cradle_datagrams_rejected_total{reason=\"fragment\"}") == 1);
  CHECK(at("cradle_datagrams_rejected_total{reason=\"bad_count\"}") == 6);
  CHECK(at("cradle_datagrams_dropped_total{reason=\"kernel_buffer\"}") == 8);
  CHECK(at("cradle_chunks_sent_total") == 9);
  CHECK(at("cradle_chunks_dropped_total{reason=\"overtaken\"}") == 10);
  CHECK(at("cradle_log_lines_dropped_total{reason=\"repeated\"}") == 11);
}

TEST_CASE("every result that a server can answer has a sample of its own") {
  const Exposition page = read_exposition(metrics_text({}));
  int results = 0;
  for (int code = 0; code < kServerResults; ++code) {
    const std::string name(to_string(static_cast<Result>(code)));
    if (name == "unlisted") continue;
    ++results;
    CHECK(page.samples.contains("cradle_commands_total{result=\"" + name + "\"}"));
  }
  CHECK(results == 27);
}

TEST_CASE("durations are counted in the bucket whose bound they do not exceed") {
  Readings r;
  for (const double seconds : {0.0, 1e-5, 1.1e-5, 0.0123, 1.0, 7.0}) r.ticks.whole.add(seconds);
  r.ticks.solve.add(0.3);
  const Exposition page = read_exposition(metrics_text(r));
  const auto bucket = [&](const std::string& le) {
    return page.samples.at("cradle_tick_seconds_bucket{le=\"" + le + "\"}");
  };
  CHECK(bucket("1e-05") == 2);
  CHECK(bucket("2e-05") == 3);
  CHECK(bucket("0.01") == 3);
  CHECK(bucket("0.02") == 4);
  CHECK(bucket("1") == 5);
  CHECK(bucket("+Inf") == 6);
  CHECK(page.samples.at("cradle_tick_seconds_sum") == Approx(8.012321));
  CHECK(page.samples.at("cradle_tick_phase_seconds_count{phase=\"solve\"}") == 1);
  CHECK(page.samples.at("cradle_tick_phase_seconds_count{phase=\"apply\"}") == 0);
}

TEST_CASE("who puts readings on the board does not wait for who reads them") {
  ReadingsBoard board;
  Readings r;
  const auto put = [&](std::int64_t bodies) {
    r.bodies = bodies;
    std::thread([&] { board.put(r); }).join();  // would not come back if it waited for the reader
  };
  const auto bodies = [](const Readings& latest) { return latest.bodies; };
  put(3);
  board.read([&](const Readings& latest) {
    put(4);
    CHECK(latest.bodies == 3);
  });
  CHECK(board.read(bodies) == 3);
  put(5);
  CHECK(board.read(bodies) == 5);
}

TEST_CASE("the checker of the text format finds what is wrong") {
  const std::string head = "# HELP a_total A.\n# TYPE a_total counter\n";
  CHECK(read_exposition(head + "a_total 1\n").faults.empty());
  CHECK(read_exposition(head + "a_total{b=\"c\",d=\"e\"} 1e-05\n").faults.empty());
  const std::string histogram = "# HELP h H.\n# TYPE h histogram\n";
  CHECK(read_exposition(histogram +
                        "h_bucket{le=\"1\"} 1\nh_bucket{le=\"+Inf\"} 2\nh_sum 3\nh_count 2\n")
            .faults.empty());
  for (const std::string& wrong : {
           head + "a_total 1",                                           // no end of line
           head + "b_total 1\n",                                         // foreign
           head + "a_total 1\na_total 2\n",                              // twice
           head + "a_total{b=\"c\",} 1\n",                               // comma
           head + "a_total one\n",                                       // number
           head,                                                         // no sample
           head + "a_total 1\n" + head + "a_total{b=\"c\"} 1\n",         // two families
           std::string("a_total 1\n"),                                   // no type
           std::string("# HELP a A.\n# TYPE a counter\na 1\n"),          // no _total
           histogram + "h_bucket{le=\"1\"} 1\nh_sum 3\nh_count 1\n",     // no +Inf
           histogram + "h_bucket{le=\"+Inf\"} 1\nh_sum 3\nh_count 2\n",  // other count
           histogram + "h_bucket{le=\"1\"} 3\nh_bucket{le=\"+Inf\"} 2\nh_sum 3\nh_count 2\n",
       }) {
    CAPTURE(wrong);
    CHECK(!read_exposition(wrong).faults.empty());
  }
}

TEST_CASE("the page's address is numeric, of loopback, and has a port") {
  for (const char* good : {"127.0.0.1:9464", "127.3.2.1:1", "[::1]:65535"}) {
    CAPTURE(good);
    CHECK(parse_page_address(good));
  }
  for (const char* bad :
       {"", ":", ":9464", "9464", "127.0.0.1", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:65536",
        "127.0.0.1:80x", "0.0.0.0:9464", "192.168.0.1:9464", "128.0.0.1:9464", "localhost:9464",
        "[::]:9464", "[::2]:9464", "::1:9464", "[127.0.0.1]:9464", "[::ffff:8.8.8.8]:9464"}) {
    CAPTURE(bad);
    CHECK(!parse_page_address(bad));
  }
}

}  // namespace cradle
