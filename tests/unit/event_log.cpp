// Files of lcm-logger, whole, cut, and made to do harm.
#include "protocol/transport/event_log.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <random>
#include <system_error>

#include "tests/unit/recordings.h"

using namespace cradle;
using namespace cradle::test;

namespace {

struct Read {
  std::vector<LoggedMessage> messages;
  std::int64_t damages = 0;
};

Read read_all(TemporaryFile& file, const std::string& bytes) {
  file.write(bytes);
  EventLogReader reader(file.path());
  Read read;
  while (auto message = reader.next()) read.messages.push_back(std::move(*message));
  read.damages = reader.damages();
  return read;
}

Read read_all(const std::string& bytes) {
  TemporaryFile file("");
  return read_all(file, bytes);
}

Log three_events() {
  Log log;
  log.add(1, "A", Bytes{1, 2, 3}).add(2, "B_CHANNEL", Bytes{}).add(3, "C", Bytes(5000, 7));
  return log;
}

}  // namespace

TEST_CASE("a file's events come in their order, with time, channel and payload") {
  const Read read = read_all(three_events().bytes);
  REQUIRE(read.messages.size() == 3);
  CHECK(read.damages == 0);
  CHECK(read.messages[0].time_us == 1);
  CHECK(read.messages[0].channel == "A");
  CHECK(read.messages[0].payload == Bytes{1, 2, 3});
  CHECK(read.messages[1].channel == "B_CHANNEL");
  CHECK(read.messages[1].payload.empty());
  CHECK(read.messages[2].payload == Bytes(5000, 7));
  CHECK(read_all("").messages.empty());
  CHECK(read_all("").damages == 0);
}

TEST_CASE("a file cut at any byte gives the events before the cut, and tells of the rest") {
  const std::string whole = three_events().bytes;
  TemporaryFile file("");
  for (std::size_t size = 0; size < whole.size(); size += size < 200 ? 1 : 97) {
    CAPTURE(size);
    const Read read = read_all(file, whole.substr(0, size));
    const std::size_t ends[] = {32, 32 + 37};
    const std::size_t events = size < ends[0] ? 0 : size < ends[1] ? 1 : 2;
    const bool is_at_end = size == 0 || size == ends[0] || size == ends[1];
    const bool is_cut_in_sync = events > 0 && !is_at_end && size - ends[events - 1] < 4;
    CHECK(read.messages.size() == (is_cut_in_sync ? events - 1 : events));
    CHECK(read.damages == (is_at_end ? 0 : 1));
  }
}

TEST_CASE("claims of any length cost nothing, and what follows them is read") {
  const std::uint64_t lengths[] = {0,          1,          64,         65537,     0x7fffffff,
                                   0x7ffffff0, 0x80000000, 0xffffffff, 0xfffffff0};
  for (const std::uint64_t channel_length : lengths) {
    for (const std::uint64_t payload_length : lengths) {
      CAPTURE(channel_length, payload_length);
      Log log;
      log.add(1, "A", Bytes{1}).claim(channel_length, payload_length).add(2, "B", Bytes{2});
      log.add(3, "C", Bytes{3});
      const Read read = read_all(log.bytes);
      REQUIRE(read.messages.size() == 3);
      CHECK(read.messages[2].channel == "C");
      CHECK(read.damages == 1);
    }
  }
}

TEST_CASE("an event larger than any datagram is passed over") {
  Log log;
  log.add(1, "A", Bytes(65536)).add(2, "B", Bytes(65537)).add(3, "C", Bytes{3});
  const Read read = read_all(log.bytes);
  REQUIRE(read.messages.size() == 2);
  CHECK(read.messages[1].channel == "C");
  CHECK(read.damages == 1);
}

TEST_CASE("garbage between events costs at most the event before it") {
  for (const std::string& garbage : {std::string("x"), std::string(300'000, '\xed'),
                                     std::string("\xed\xa1\xda", 3), std::string(100, '\0')}) {
    Log log;
    log.add(1, "A", Bytes{1}).add(2, "B", Bytes{2});
    log.bytes += garbage;
    log.add(3, "C", Bytes{3});
    const Read read = read_all(log.bytes);
    REQUIRE(read.messages.size() == 2);
    CHECK(read.messages[0].channel == "A");
    CHECK(read.messages[1].channel == "C");
    CHECK(read.damages == 1);
  }
  CHECK(read_all(std::string(1000, 'x')).messages.empty());
  CHECK(read_all(std::string(1000, 'x')).damages == 1);
}

TEST_CASE("files with any bytes changed are read to their end") {
  std::mt19937 random(1);
  const std::string whole = three_events().bytes;
  TemporaryFile file("");
  for (int round = 0; round < 2000; ++round) {
    std::string bytes = whole;
    for (int k = 0; k < 1 + round % 5; ++k) bytes[random() % 100] = static_cast<char>(random());
    CHECK(read_all(file, bytes).messages.size() <= 3);
  }
}

TEST_CASE("a file without end is told as such, and 64 MiB without an event are the end") {
  CHECK_THROWS_AS(EventLogReader("/dev/zero"), std::system_error);
  TemporaryFile file("");
  std::filesystem::resize_file(file.path(), std::uintmax_t{1} << 32);  // sparse
  EventLogReader reader(file.path());
  CHECK_FALSE(reader.next());
  CHECK(reader.damages() == 1);
}

TEST_CASE("what is no file is told with its reason") {
  CHECK_THROWS_WITH(EventLogReader("/no/such/file"), "No such file or directory");
  CHECK_THROWS_WITH(EventLogReader("/tmp"), "Is a directory");
}
