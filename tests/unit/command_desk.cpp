// Sessions, sequences, target ticks: who is answered what, and what is due when. Time is the
// test's.
#include "server/command_desk.h"

#include <cradle/limits.h>
#include <cradle/version.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <random>

#include "protocol/validate.h"

namespace cradle {
namespace {

constexpr std::int64_t kEpoch = 77;
constexpr std::int64_t kSecond_us = 1'000'000;
constexpr std::int64_t kSilence_us = 10 * kSecond_us;  // as world_status_v3.lcm says of clients

Command hello(std::int64_t client, std::int64_t sequence = 1, int version = kProtocolVersion) {
  return {{client, sequence, 0, 0}, Hello{version, "client " + std::to_string(client)}};
}
Command command(std::int64_t client, std::int64_t sequence, Tick target = 0) {
  return {{client, sequence, kEpoch, target},
          SetGravity{{static_cast<double>(client), static_cast<double>(sequence), 0}}};
}
RawCommand raw(const Command& c) { return {kind_of(c.body), encode(c)}; }

using Headers = std::vector<CommandHeader>;
Headers headers_of(const std::vector<Command>& commands) {
  Headers headers;
  for (const Command& c : commands) headers.push_back(c.header);
  return headers;
}

/// A desk, the tick it waits for, and the time.
struct Office {
  CommandDesk desk{kEpoch};
  Tick coming = 1;
  std::int64_t now_us = 5 * kSecond_us;

  void arrive(const std::vector<Command>& commands) {
    Inbox::Contents contents;
    for (const Command& c : commands) contents.commands.push_back(raw(c));
    desk.admit(std::move(contents), coming, now_us);
  }
  void arrive_raw(RawCommand bytes) {
    Inbox::Contents contents;
    contents.commands.push_back(std::move(bytes));
    desk.admit(std::move(contents), coming, now_us);
  }

  /// Hands out what is due and answers it, with ok if it means something.
  Headers work(bool is_stepping = true) {
    const std::vector<Command> due = desk.take_due(coming, is_stepping);
    for (const Command& c : due) desk.answer(c.header, validate(c.body), coming);
    return headers_of(due);
  }

  void welcome(std::int64_t client) {
    arrive({hello(client)});
    work();
    REQUIRE(results() == std::vector<Result>{Result::ok});
  }

  std::vector<Result> results() {
    std::vector<Result> all;
    for (const Receipt& receipt : desk.take_receipts()) all.push_back(receipt.outcome.result);
    return all;
  }
  Result result_of(const Command& c) {
    arrive({c});
    work();
    const auto all = results();
    REQUIRE(all.size() == 1);
    return all[0];
  }
};

}  // namespace

TEST_CASE("a client is unknown until its hello, whose sequence its commands continue") {
  Office office;
  CHECK(office.result_of(command(7, 1)) == Result::unknown_client);
  CHECK(office.result_of(hello(7, 40)) == Result::ok);
  CHECK(office.result_of(command(7, 41)) == Result::ok);
  CHECK(office.result_of(command(8, 41)) == Result::unknown_client);
  CHECK(office.desk.take_newcomers() == std::vector<std::string>{"client 7"});
  CHECK(office.desk.take_newcomers().empty());
}

TEST_CASE("a command for another run of the server is refused and takes no number") {
  Office office;
  office.welcome(7);
  Command stale = command(7, 2);
  stale.header.epoch = kEpoch - 1;
  CHECK(office.result_of(stale) == Result::wrong_epoch);
  stale.header.epoch = 0;
  CHECK(office.result_of(stale) == Result::wrong_epoch);
  CHECK(office.result_of(command(7, 2)) == Result::ok);
}

TEST_CASE("a hello for another run of the server is refused, too, and one for any run is taken") {
  Office office;
  Command recorded = hello(7);
  recorded.header.epoch = kEpoch - 1;
  CHECK(office.result_of(recorded) == Result::wrong_epoch);
  CHECK(office.desk.clients(office.now_us) == 0);
  recorded.header.epoch = kEpoch;
  CHECK(office.result_of(recorded) == Result::ok);
  recorded = hello(8);
  recorded.header.epoch = 0;
  CHECK(office.result_of(recorded) == Result::ok);
}

TEST_CASE("a hello of another version or with a bad name opens no session") {
  Office office;
  CHECK(office.result_of(hello(7, 1, kProtocolVersion + 1)) == Result::bad_version);
  Command rude = hello(7);
  std::get<Hello>(rude.body).name = "two\nlines";
  CHECK(office.result_of(rude) == Result::bad_name);
  CHECK(office.result_of(command(7, 2)) == Result::unknown_client);
  CHECK(office.desk.take_newcomers().empty());
  CHECK(office.desk.clients(office.now_us) == 0);
  CHECK(office.result_of(hello(7)) == Result::ok);
}

TEST_CASE("a repeated hello gets the first answer, a new one is a command like others") {
  Office office;
  office.welcome(7);
  office.arrive({hello(7)});
  CHECK(office.work().empty());
  CHECK(office.results() == std::vector<Result>{Result::ok});
  office.arrive({hello(7, 2)});
  CHECK(office.work() == Headers{hello(7, 2).header});
  CHECK(office.desk.take_newcomers().size() == 1);
  CHECK(office.desk.clients(office.now_us) == 1);
}

TEST_CASE("a repeated command is not due again and gets the receipt of the first") {
  Office office;
  office.welcome(7);
  office.arrive({command(7, 2), command(7, 2)});  // doubled on the way, before any answer
  CHECK(office.work() == Headers{command(7, 2).header});
  const auto first = office.desk.take_receipts();
  REQUIRE(first.size() == 1);
  office.coming = 30;
  office.arrive({command(7, 2)});
  CHECK(office.work().empty());
  CHECK(office.desk.take_receipts() == first);
}

TEST_CASE("commands behind a missing one are held, and answered in their turn") {
  Office office;
  office.welcome(7);
  office.arrive({command(7, 4), command(7, 3)});
  CHECK(office.work().empty());
  CHECK(office.results() == std::vector<Result>(2, Result::held));
  office.arrive({command(7, 2)});
  CHECK(office.work() == Headers{command(7, 2).header, command(7, 3).header, command(7, 4).header});
  CHECK(office.results() == std::vector<Result>(3, Result::ok));
  CHECK(office.result_of(command(7, 5 + limits::kHeldCommands)) == Result::gap);
}

TEST_CASE("a command for a later tick is queued at once, due at its tick, and answered then") {
  Office office;
  office.welcome(7);
  office.coming = 10;
  const Command later = command(7, 2, 12);
  office.arrive({later});
  const auto queued = office.desk.take_receipts();
  REQUIRE(queued.size() == 1);
  CHECK(queued[0] == Receipt{7, 2, 12, {Result::queued, {}, 0}});
  CHECK(office.work().empty());
  office.arrive({later});  // told again while it waits
  CHECK(office.desk.take_receipts() == queued);
  office.coming = 11;
  CHECK(office.work().empty());
  office.coming = 12;
  CHECK(office.work() == Headers{later.header});
  CHECK(office.desk.take_receipts() == std::vector<Receipt>{{7, 2, 12, {}}});
  office.arrive({later});
  CHECK(office.desk.take_receipts() == std::vector<Receipt>{{7, 2, 12, {}}});
  CHECK(office.desk.applied() == 2);  // with the hello; `queued` does not count
  CHECK(office.desk.refused() == 0);
}

TEST_CASE("while the world stands still, commands without a target are due, others wait") {
  Office office;
  office.welcome(7);
  office.arrive({command(7, 2, 1), command(7, 3)});
  CHECK(office.work(false) == Headers{command(7, 3).header});
  CHECK(office.work(false).empty());
  CHECK(office.work(true) == Headers{command(7, 2, 1).header});
}

TEST_CASE("targets in the past are late, those too far ahead are refused") {
  Office office;
  office.welcome(7);
  office.coming = 100;
  CHECK(office.result_of(command(7, 2, 99)) == Result::late);
  CHECK(office.result_of(command(7, 3, 100 + limits::kTicksAhead + 1)) == Result::too_far_ahead);
  CHECK(office.result_of(command(7, 4, limits::kIntegerMax)) == Result::too_far_ahead);
  CHECK(office.result_of(command(7, 5, 100 + limits::kTicksAhead)) == Result::queued);
  office.arrive({command(7, 6, 100)});
  CHECK(office.work() == Headers{command(7, 6, 100).header});
  CHECK(office.results() == std::vector<Result>{Result::queued, Result::ok});
  CHECK(office.desk.refused() == 3);
  office.arrive({command(7, 2, 99)});
  CHECK(office.results() == std::vector<Result>{Result::late});  // a refusal is kept as well
}

TEST_CASE("the order of effects depends on client and sequence, never on arrival") {
  std::vector<Command> all;
  for (const std::int64_t client : {11, 5, 90, 7}) {
    for (std::int64_t sequence = 2; sequence <= 9; ++sequence) {
      const Tick targets[] = {0, 1, 2};
      all.push_back(command(client, sequence, targets[(sequence * client) % 3]));
    }
  }
  const auto expected_at = [&](const std::vector<Tick>& targets) {
    Headers headers;
    for (const Command& c : all) {
      if (std::count(targets.begin(), targets.end(), c.header.target_tick) > 0) {
        headers.push_back(c.header);
      }
    }
    std::sort(headers.begin(), headers.end(), [](const auto& a, const auto& b) {
      return std::pair(a.client, a.sequence) < std::pair(b.client, b.sequence);
    });
    return headers;
  };
  std::mt19937_64 random(41);
  for (int round = 0; round < 200; ++round) {
    CAPTURE(round);
    Office office;
    for (const std::int64_t client : {90, 7, 11, 5}) office.welcome(client);
    std::shuffle(all.begin(), all.end(), random);
    const auto split = all.begin() + static_cast<std::ptrdiff_t>(random() % all.size());
    office.arrive({all.begin(), split});  // in two bursts before the same tick
    office.arrive({split, all.end()});
    REQUIRE(office.work() == expected_at({0, 1}));
    office.coming = 2;
    REQUIRE(office.work() == expected_at({2}));
  }
}

TEST_CASE("the world takes 64 clients, one more replaces the one that is silent longest") {
  Office office;
  const std::int64_t most = limits::kClients;
  for (std::int64_t client = 1; client <= most; ++client) {
    office.welcome(client);
    office.now_us += 1000;
  }
  const std::int64_t first_heard_us = 5 * kSecond_us;
  CHECK(office.result_of(hello(100)) == Result::over_quota);
  office.now_us = first_heard_us + kSilence_us - 1;
  CHECK(office.result_of(hello(100)) == Result::over_quota);
  office.now_us = first_heard_us + kSilence_us + 500;  // client 2 was heard 1000 us after client 1
  CHECK(office.result_of(hello(100)) == Result::ok);
  CHECK(office.result_of(hello(101)) == Result::over_quota);
  CHECK(office.result_of(command(1, 2)) == Result::unknown_client);
  CHECK(office.result_of(command(2, 2)) == Result::ok);
  CHECK(office.result_of(command(100, 2)) == Result::ok);
}

TEST_CASE("a silent client for whom something is queued keeps its place, the next one gives way") {
  Office office;
  const std::int64_t most = limits::kClients;
  for (std::int64_t client = 1; client <= most; ++client) office.welcome(client);
  CHECK(office.result_of(command(1, 2, 5000)) == Result::queued);
  for (std::int64_t client = 3; client <= most; ++client) {
    office.now_us += 1;
    CHECK(office.result_of(command(client, 2)) == Result::ok);
  }
  office.now_us += kSilence_us;
  CHECK(office.result_of(hello(100)) == Result::ok);
  CHECK(office.result_of(command(2, 2)) == Result::unknown_client);
  office.coming = 5000;
  CHECK(office.work() == Headers{command(1, 2, 5000).header});
}

TEST_CASE("if something is queued for everybody, nobody gives way") {
  Office office;
  for (std::int64_t client = 1; client <= limits::kClients; ++client) {
    office.welcome(client);
    CHECK(office.result_of(command(client, 2, 5000)) == Result::queued);
  }
  office.now_us += 2 * kSilence_us;
  CHECK(office.result_of(hello(100)) == Result::over_quota);
  office.coming = 5000;
  CHECK(office.work().size() == limits::kClients);
}

TEST_CASE("clients are counted while they are heard") {
  Office office;
  office.welcome(1);
  office.now_us += kSecond_us;
  office.welcome(2);
  CHECK(office.desk.clients(office.now_us) == 2);
  CHECK(office.desk.clients(office.now_us + kSilence_us) == 1);
  CHECK(office.desk.clients(office.now_us + kSilence_us + 1) == 0);
  office.now_us += kSilence_us + 1;
  CHECK(office.result_of(command(1, 2)) == Result::ok);
  CHECK(office.desk.clients(office.now_us) == 1);
}

TEST_CASE("a client may queue 4096 commands for later ticks, and more when some are done") {
  Office office;
  office.welcome(7);
  office.welcome(8);
  std::int64_t sequence = 2;
  for (int i = 0; i < limits::kQueuedCommands; ++i) {
    office.arrive({command(7, sequence++, 2 + i % 2)});
  }
  for (const Result result : office.results()) REQUIRE(result == Result::queued);
  CHECK(office.result_of(command(7, sequence++, 3)) == Result::over_quota);
  CHECK(office.result_of(command(7, sequence++)) == Result::ok);  // without a target
  CHECK(office.result_of(command(8, 2, 3)) == Result::queued);    // another client
  office.coming = 2;
  CHECK(office.work().size() == limits::kQueuedCommands / 2);
  office.results();
  CHECK(office.result_of(command(7, sequence++, 3)) == Result::queued);
}

TEST_CASE("what the inbox had no room for is told busy, and can be sent again") {
  Office office;
  office.welcome(7);
  Inbox::Contents contents;
  contents.overflow.push_back(command(7, 2).header);
  office.desk.admit(std::move(contents), office.coming, office.now_us);
  CHECK(office.desk.take_receipts() == std::vector<Receipt>{{7, 2, 0, {Result::busy, {}, 0}}});
  CHECK(office.result_of(command(7, 2)) == Result::ok);
}

TEST_CASE("answers are counted by what they say, repeated ones apart") {
  Office office;
  office.welcome(7);
  CHECK(office.result_of(command(7, 2)) == Result::ok);
  CHECK(office.result_of(command(7, 2)) == Result::ok);  // again
  CHECK(office.result_of(command(7, 3 + limits::kHeldCommands)) == Result::gap);
  CHECK(office.result_of(command(9, 1)) == Result::unknown_client);
  office.arrive({command(7, 3, office.coming)});  // for a tick: queued, then done
  office.work();
  CHECK(office.results() == std::vector<Result>{Result::queued, Result::ok});
  const CommandDesk& desk = office.desk;
  CHECK(desk.answered(Result::ok) == 3);  // hello, 2, 3
  CHECK(desk.answered(Result::queued) == 1);
  CHECK(desk.answered(Result::gap) == 1);
  CHECK(desk.answered(Result::unknown_client) == 1);
  CHECK(desk.repeated() == 1);
  CHECK(desk.applied() == 3);
  CHECK(desk.refused() == 2);
}

TEST_CASE("malformed bytes with a known client's header are told so in their turn") {
  Office office;
  office.welcome(7);
  RawCommand bad = raw(command(7, 2));
  bad.payload[0] ^= 1;  // another type's fingerprint
  office.arrive({command(7, 3)});
  CHECK(office.results() == std::vector{Result::held});  // it waits for number 2
  office.arrive_raw(bad);
  office.work();
  CHECK(office.results() == std::vector{Result::malformed, Result::ok});
  CHECK(office.result_of(command(7, 2)) == Result::malformed);  // the first answer stays
  CHECK(office.result_of(command(7, 4)) == Result::ok);
  bad = raw(command(7, 4));
  bad.payload[0] ^= 1;
  office.arrive_raw(bad);  // a damaged copy of an answered command
  CHECK(office.results() == std::vector{Result::ok});
  CHECK(office.desk.malformed() == 2);
}

TEST_CASE("a client that is started again under its number goes on from a new hello") {
  Office office;
  office.welcome(7);
  CHECK(office.result_of(command(7, 2)) == Result::ok);
  office.arrive({command(7, 3, office.coming + 1), command(7, 5)});  // one queued, one held
  office.results();
  const std::int64_t first = 4 + limits::kHeldCommands;
  CHECK(office.result_of(command(7, first + 1)) == Result::gap);  // not by any other command
  CHECK(office.result_of(hello(7, first)) == Result::ok);
  CHECK(office.result_of(command(7, first + 1)) == Result::ok);
  CHECK(office.result_of(command(7, 4)) == Result::superseded);
  ++office.coming;
  CHECK(office.work().size() == 1);  // what its earlier run has queued
  CHECK(office.desk.waiting_bytes() == 0);
}

TEST_CASE("what waits is bounded in bytes, and can be sent again when there is room") {
  Office office;
  const auto large = [](std::int64_t client, std::int64_t sequence, Tick target) {
    Command c = command(client, sequence, target);
    c.body = Push{std::vector<Wrench>(500)};
    return c;
  };
  const std::int64_t bytes = encoded_size(large(1, 2, 0).body);
  const std::int64_t room = limits::kWaitingBytes / bytes;
  const std::int64_t each = room / 10;
  std::int64_t taken = 0;
  for (std::int64_t client = 1; client <= 11; ++client) {
    office.welcome(client);
    for (std::int64_t s = 2; s < 2 + each; ++s) {
      office.arrive({large(client, s, office.coming + 1)});
      for (const Result result : office.results()) {
        if (result == Result::queued) ++taken;
      }
    }
    CHECK(office.desk.waiting_bytes() <= limits::kWaitingBytes);
  }
  CHECK(taken == room);
  const std::int64_t next = 2 + each;
  CHECK(office.result_of(large(1, next, 0)) == Result::busy);
  Command step = command(1, next);
  step.body = Control{ControlAction::step, 1};
  CHECK(office.result_of(step) == Result::ok);  // what a full world waits for
  ++office.coming;
  CHECK(office.work().size() == static_cast<std::size_t>(room));
  CHECK(office.desk.waiting_bytes() == 0);
  office.results();
  CHECK(office.result_of(command(1, next + 1)) == Result::ok);
}

TEST_CASE(
    "malformed bytes of strangers, or with a header of impossible numbers, are only counted") {
  Office office;
  office.welcome(7);
  RawCommand stranger = raw(command(8, 2));
  stranger.payload[0] ^= 1;
  office.arrive_raw(stranger);
  // A receipt with such a sequence would make everybody refuse the datagram it is in.
  office.arrive_raw(raw(command(7, -2)));
  office.arrive_raw(raw(command(7, limits::kIntegerMax + 1)));
  office.arrive_raw({MessageKind::spawn, {}});
  CHECK(office.results().empty());
  CHECK(office.desk.malformed() == 4);
}

TEST_CASE("every receipt that the desk gives out can be sent") {
  // Random commands of all sorts, half of them spoilt: what comes out must decode again.
  std::mt19937_64 random(43);
  Office office;
  for (std::int64_t client = 1; client <= 3; ++client) office.welcome(client);
  for (int round = 0; round < 20'000; ++round) {
    Command c = command(1 + static_cast<std::int64_t>(random() % 4),
                        static_cast<std::int64_t>(random() % 400),
                        static_cast<Tick>(random() % 5) * office.coming);
    RawCommand bytes = raw(c);
    if (random() % 2 == 0) bytes.payload[random() % bytes.payload.size()] ^= 0x81;
    office.arrive_raw(bytes);
    if (random() % 8 == 0) {
      office.work(random() % 2 == 0);
      ++office.coming;
    }
    const Receipts message{kEpoch, office.desk.take_receipts()};
    REQUIRE(decode_receipts(encode(message)) == message);
  }
  CHECK(office.desk.applied() > 100);
  CHECK(office.desk.refused() > 100);
}

}  // namespace cradle
