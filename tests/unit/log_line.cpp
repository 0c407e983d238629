// A log line is one line, valid, and obeyed by no terminal, whatever bytes it is made of.
#include "server/log_line.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <random>

#include "protocol/validate.h"

namespace cradle {
namespace {

constexpr std::int64_t kNewYear_ms = 1'767'225'600'007;  // 2026-01-01T00:00:00.007Z

std::string text(std::string_view message, std::vector<LogField> fields = {}) {
  return log_line(LogFormat::text, kNewYear_ms, "info", message, fields);
}
nlohmann::json json(std::string_view message, std::vector<LogField> fields = {}) {
  return nlohmann::json::parse(log_line(LogFormat::json, kNewYear_ms, "info", message, fields));
}

}  // namespace

TEST_CASE("a text line has time, level, message and fields") {
  CHECK(text("world begins", {{"world", "w"}, {"bodies", std::int64_t{3}}, {"rate_hz", 62.5}}) ==
        "2026-01-01T00:00:00.007Z info world begins world=\"w\" bodies=3 rate_hz=62.5");
}

TEST_CASE("a JSON line is an object of the same") {
  const nlohmann::json expected = {{"time", "2026-01-01T00:00:00.007Z"},
                                   {"level", "info"},
                                   {"message", "world begins"},
                                   {"world", "w"},
                                   {"bodies", 3},
                                   {"rate_hz", 62.5}};
  CHECK(json("world begins", {{"world", "w"}, {"bodies", std::int64_t{3}}, {"rate_hz", 62.5}}) ==
        expected);
  CHECK(json("m", {{"x", std::nan("")}})["x"].is_null());
}

TEST_CASE("what a terminal would obey is shown, not sent") {
  CHECK(text("a\nb", {{"name", "\x1b[2J"}}).ends_with("info a\\x0ab name=\"\\x1b[2J\""));
  CHECK(text("m", {{"name", "say \"hi\\"}}).ends_with(R"(name="say \"hi\\")"));
  CHECK(text("m", {{"name",
                    "\xc2\x9b"
                    "2J"}})
            .ends_with(R"(name="\u{009b}2J")"));                                 // CSI as C1
  CHECK(text("m", {{"name", "\xe2\x80\xae"}}).ends_with(R"(name="\u{202e}")"));  // right to left
  CHECK(text("m", {{"name", "\xff\xc0\x80"}}).ends_with(R"(name="\xff\xc0\x80")"));  // no UTF-8
  CHECK(text("m", {{"name", "Käthe 球"}}).ends_with("name=\"Käthe 球\""));
}

TEST_CASE("JSON gives names back as they were, and no UTF-8 as U+FFFD") {
  for (const std::string name : {"Käthe 球 \xf0\x9f\x98\x80", "\"\\/", "\x01\n\t\x1b", "\u202e"}) {
    CHECK(json("m", {{"name", name}})["name"] == name);
  }
  CHECK(json("m", {{"name", "a\xff"}})["name"] == "a\ufffd");
  CHECK(json("m", {{"name", "\xed\xa0\x80"}})["name"] == "\ufffd\ufffd\ufffd");  // a surrogate
}

TEST_CASE("20 000 random texts make one line of clean UTF-8, and JSON that can be read") {
  std::mt19937 random(1);
  for (int round = 0; round < 20'000; ++round) {
    std::string bytes(random() % 24, '\0');
    for (char& byte : bytes) {
      byte = static_cast<char>(random() % 3 == 0 ? 0xE2 - random() % 3 : random());
    }
    const std::string line = text(bytes, {{"name", bytes}});
    CAPTURE(line);
    REQUIRE(is_name(line, 1'000'000));  // valid, and without control characters
    const auto read = json(bytes, {{"name", bytes}});
    if (is_name(bytes, 1'000'000)) REQUIRE(read["name"] == bytes);
  }
}

}  // namespace cradle
