// Ten lines in ten seconds for each place that can repeat itself, and nothing left out in silence.
#include "server/log_places.h"

#include <catch2/catch.hpp>
#include <string>

namespace cradle {
namespace {

constexpr std::int64_t kOneSecond_us = 1'000'000;

/// Two places and what they wrote.
struct PlacesLog {
  std::vector<std::string> lines;
  LogPlaces places{[this](LogLevel, std::string_view message, std::span<const LogField> fields) {
    lines.emplace_back(message);
    for (const LogField& field : fields) {
      if (const auto* text = std::get_if<std::string_view>(&field.value)) {
        lines.back() += ": " + std::string(*text);
      }
    }
  }};
  LogPlace noisy{places, LogLevel::warn, "noise"};
  LogPlace calm{places, LogLevel::info, "calm"};

  std::vector<std::string> take() { return std::exchange(lines, {}); }
  void repeat(int count, std::int64_t now_us) {
    for (int i = 0; i < count; ++i) noisy.write(now_us, {});
  }
};

using Lines = std::vector<std::string>;

}  // namespace

TEST_CASE("a place writes ten lines in ten seconds and then tells how many more there were") {
  PlacesLog log;
  log.repeat(13, 5 * kOneSecond_us);
  CHECK(log.take() == Lines(10, "noise"));
  CHECK(log.places.left_out() == 3);
  log.repeat(2, 15 * kOneSecond_us - 1);
  CHECK(log.take().empty());
  log.repeat(1, 15 * kOneSecond_us);  // a new interval
  CHECK(log.take() == Lines{"5 more like this: noise", "noise"});
  CHECK(log.places.left_out() == 5);
}

TEST_CASE("what was left out is told when the interval is over, even if nothing more comes") {
  PlacesLog log;
  log.repeat(11, 0);
  log.take();
  log.places.tell_due(10 * kOneSecond_us - 1);
  CHECK(log.take().empty());
  log.places.tell_due(10 * kOneSecond_us);
  CHECK(log.take() == Lines{"1 more like this: noise"});
  log.places.tell_due(30 * kOneSecond_us);
  CHECK(log.take().empty());
}

TEST_CASE("what was left out is told at the end") {
  PlacesLog log;
  log.repeat(12, 0);
  log.take();
  log.places.tell_all();
  CHECK(log.take() == Lines{"2 more like this: noise"});
}

TEST_CASE("one place does not silence another") {
  PlacesLog log;
  log.repeat(100, 0);
  log.take();
  log.calm.write(0, {{"name", "ann"}});
  CHECK(log.take() == Lines{"calm: ann"});
}

TEST_CASE("ten lines an interval pass for good, and nothing is told of") {
  PlacesLog log;
  for (int k = 0; k < 5; ++k) {
    log.repeat(10, 10 * k * kOneSecond_us);
    CHECK(log.take() == Lines(10, "noise"));
  }
  CHECK(log.places.left_out() == 0);
}

}  // namespace cradle
