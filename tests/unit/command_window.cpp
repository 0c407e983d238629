// Exactly once and in order over a wire that loses, doubles and reorders. The clock is the test's.
#include "protocol/command_window.h"

#include <cradle/limits.h>

#include <catch2/catch.hpp>
#include <random>

namespace cradle {
namespace {

using namespace std::chrono_literals;
using VerdictKind = ReceiveWindow::Verdict::Kind;
using Time = SendWindow::Time;

constexpr std::int64_t kClient = 7;
constexpr Time kWindowStart{1000h};

/// A command that tells its sequence again in its body.
Command numbered(std::int64_t sequence) {
  return {{kClient, sequence, 9, 0}, SetGravity{{static_cast<double>(sequence), 0, 0}}};
}
Bytes payload(std::int64_t sequence) { return encode(numbered(sequence)); }

Receipt receipt(std::int64_t sequence, Result result = Result::ok) {
  return {kClient, sequence, 100 + sequence, {result, {1000 + sequence}, 0}};
}

/// Brings 1 .. last to the window and answers each with ok.
void answer_up_to(ReceiveWindow& window, std::int64_t last) {
  for (std::int64_t sequence = window.next(); sequence <= last; ++sequence) {
    window.arrive(numbered(sequence));
    REQUIRE(window.take_next());
    window.keep(receipt(sequence));
  }
}

Result answer_to(ReceiveWindow& window, std::int64_t sequence) {
  const auto verdict = window.arrive(numbered(sequence));
  REQUIRE(verdict.kind == VerdictKind::answered);
  CHECK(verdict.receipt.client == kClient);
  CHECK(verdict.receipt.sequence == sequence);
  return verdict.receipt.outcome.result;
}

/// Loses, doubles and delays by chance; what is delayed differently is reordered.
template <class Item>
class BadWire {
 public:
  BadWire(std::uint64_t seed, double loss) : random_(seed), loss_(loss) {}

  void send(Time now, const Item& item) {
    do {
      if (chance() >= loss_) under_way_.emplace(now + 1us * (random_() % 60'000), item);
    } while (chance() < 0.2);
  }

  std::vector<Item> arrived(Time now) {
    std::vector<Item> items;
    const auto end = under_way_.upper_bound(now);
    for (auto entry = under_way_.begin(); entry != end; ++entry) items.push_back(entry->second);
    under_way_.erase(under_way_.begin(), end);
    return items;
  }

 private:
  double chance() { return static_cast<double>(random_() % 1000) / 1000; }

  std::mt19937_64 random_;
  double loss_;
  std::multimap<Time, Item> under_way_;
};

/// A server that answers at the end of its tick; every tenth command `queued` first, and finally
/// some ticks later.
struct Server {
  ReceiveWindow window{1};
  std::vector<std::int64_t> taken;
  std::multimap<int, std::int64_t> later;  ///< by tick
  int tick = 0;

  std::vector<Receipt> do_tick(const std::vector<Bytes>& datagrams) {
    ++tick;
    std::vector<Receipt> answers;
    const auto answer = [&](const Receipt& r) {
      window.keep(r);
      answers.push_back(r);
    };
    std::vector<std::int64_t> fresh;
    for (const Bytes& datagram : datagrams) {
      auto arrived = decode_command(MessageKind::set_gravity, datagram);
      const auto verdict = window.arrive(std::move(arrived.value()));
      if (verdict.kind == VerdictKind::answered) answers.push_back(verdict.receipt);
      while (const auto next = window.take_next()) fresh.push_back(next->header.sequence);
    }
    for (const std::int64_t sequence : fresh) {
      taken.push_back(sequence);
      const bool is_for_later = sequence % 10 == 0;
      if (is_for_later) later.emplace(tick + static_cast<int>(sequence) % 37, sequence);
      answer(receipt(sequence, is_for_later ? Result::queued : Result::ok));
    }
    for (auto due = later.begin(); due != later.end() && due->first <= tick;) {
      answer(receipt(due->second));
      due = later.erase(due);
    }
    return answers;
  }
};

}  // namespace

TEST_CASE("every command is taken once, in order, and answered, whatever the wire does") {
  constexpr std::int64_t kCommands = 1000;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const double loss = 0.6 * static_cast<double>(seed - 1) / 19;
    CAPTURE(seed, loss);
    BadWire<Bytes> to_server(seed, loss);
    BadWire<Receipt> to_client(seed + 100, loss);
    Server server;
    SendWindow client;
    std::vector<int> answers(kCommands + 1, 0);
    Time now = kWindowStart;
    for (; client.next_sequence() <= kCommands || client.size() > 0; now += 4ms) {
      REQUIRE(now < kWindowStart + 10min);
      for (int i = 0; i < 3 && client.has_room() && client.next_sequence() <= kCommands; ++i) {
        client.add(MessageKind::set_gravity, payload(client.next_sequence()), now);
      }
      client.send_due(now, [&](MessageKind, ByteView bytes) {
        to_server.send(now, Bytes(bytes.begin(), bytes.end()));
      });
      if ((now - kWindowStart) % 16ms == 0ms) {
        for (const Receipt& r : server.do_tick(to_server.arrived(now))) {
          REQUIRE(r.outcome.result != Result::gap);  // an honest client stays within the window
          to_client.send(now, r);
        }
      }
      for (const Receipt& r : to_client.arrived(now)) {
        const auto round_trip = client.answer(r, now);
        if (!round_trip) continue;
        REQUIRE(r == receipt(r.sequence));  // the answer first given, neither another nor expired
        REQUIRE(*round_trip >= 0ms);
        ++answers[static_cast<std::size_t>(r.sequence)];
      }
    }
    REQUIRE(server.taken.size() == kCommands);
    for (std::int64_t sequence = 1; sequence <= kCommands; ++sequence) {
      REQUIRE(server.taken[static_cast<std::size_t>(sequence) - 1] == sequence);
      REQUIRE(answers[static_cast<std::size_t>(sequence)] == 1);
    }
    CHECK(server.window.held().empty());
  }
}

TEST_CASE("commands behind a gap are held up to the window's end, and refused beyond it") {
  ReceiveWindow window(1);
  const std::int64_t end = 1 + limits::kHeldCommands;
  CHECK(window.arrive(numbered(end - 1)).kind == VerdictKind::held);
  CHECK(answer_to(window, end) == Result::gap);
  CHECK(answer_to(window, limits::kIntegerMax) == Result::gap);
  CHECK(!window.take_next());
  for (std::int64_t sequence = 2; sequence < end - 1; ++sequence) {
    CHECK(window.arrive(numbered(sequence)).kind == VerdictKind::held);
  }
  CHECK(window.held().size() == static_cast<std::size_t>(limits::kHeldCommands - 1));
  CHECK(window.arrive(numbered(1)).kind == VerdictKind::in_order);
  for (std::int64_t sequence = 1; sequence < end; ++sequence) {
    CHECK(window.take_next() == numbered(sequence));
  }
  CHECK(!window.take_next());
  CHECK(window.arrive(numbered(end)).kind == VerdictKind::in_order);  // refused before, taken now
}

TEST_CASE("of a command that comes twice while it is held, the first is taken") {
  ReceiveWindow window(1);
  Command first = numbered(2), second = numbered(2);
  second.body = SetGravity{{-1, -1, -1}};
  CHECK(window.arrive(Command(first)).kind == VerdictKind::held);
  CHECK(window.arrive(std::move(second)).kind == VerdictKind::held);
  window.arrive(numbered(1));
  CHECK(window.take_next() == numbered(1));
  CHECK(window.take_next() == first);
  CHECK(!window.take_next());
}

TEST_CASE("a command repeated before its answer is given is neither taken again nor expired") {
  ReceiveWindow window(1);
  window.arrive(numbered(1));
  REQUIRE(window.take_next());
  CHECK(window.arrive(numbered(1)).kind == VerdictKind::held);
  CHECK(!window.take_next());
  window.keep(receipt(1, Result::unknown_body));
  CHECK(answer_to(window, 1) == Result::unknown_body);
}

TEST_CASE("the last 1024 answers are repeated, older ones have expired") {
  ReceiveWindow window(1);
  answer_up_to(window, limits::kReceiptsKept);
  CHECK(window.arrive(numbered(1)).receipt == receipt(1));
  answer_up_to(window, limits::kReceiptsKept + 1);
  CHECK(answer_to(window, 1) == Result::expired);
  CHECK(window.arrive(numbered(2)).receipt == receipt(2));
}

TEST_CASE("what is before the client's first command is of one that it has superseded") {
  ReceiveWindow window(50);
  CHECK(answer_to(window, 49) == Result::superseded);
  CHECK(window.arrive(numbered(50)).kind == VerdictKind::in_order);
}

TEST_CASE("a queued command is told so until its final answer, however many come between") {
  ReceiveWindow window(1);
  window.arrive(numbered(1));
  window.take_next();
  window.keep(receipt(1, Result::queued));
  answer_up_to(window, 3 * limits::kReceiptsKept);
  CHECK(answer_to(window, 1) == Result::queued);
  window.keep(receipt(1, Result::ok));
  CHECK(answer_to(window, 1) == Result::ok);
  answer_up_to(window, 4 * limits::kReceiptsKept - 1);
  CHECK(answer_to(window, 1) == Result::ok);
  answer_up_to(window, 4 * limits::kReceiptsKept);
  CHECK(answer_to(window, 1) == Result::expired);
}

TEST_CASE("a client has room for as many commands as the server takes, counted from the oldest") {
  SendWindow client;
  const auto fill = [&] {
    int added = 0;
    for (; client.has_room(); ++added) client.add(MessageKind::set_gravity, {}, kWindowStart);
    return added;
  };
  CHECK(fill() == limits::kHeldCommands);
  client.answer(receipt(2), kWindowStart);
  CHECK(fill() == 0);  // the oldest is still unanswered
  client.answer(receipt(1), kWindowStart);
  CHECK(fill() == 2);
  client.answer(receipt(3, Result::queued), kWindowStart);
  CHECK(fill() == 1);  // the server has it, so its window has moved on
  CHECK(client.is_pending(3));
}

TEST_CASE("a full window that arrives in any order meets no gap") {
  SendWindow client;
  std::vector<std::int64_t> sequences;
  while (client.has_room()) {
    sequences.push_back(client.next_sequence());
    client.add(MessageKind::set_gravity, {}, kWindowStart);
  }
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    std::mt19937_64 random(seed);
    if (seed == 1) std::reverse(sequences.begin(), sequences.end());
    if (seed > 1) std::shuffle(sequences.begin(), sequences.end(), random);
    ReceiveWindow server(1);
    int taken = 0;
    for (const std::int64_t sequence : sequences) {
      CHECK(server.arrive(numbered(sequence)).kind != VerdictKind::answered);
      while (server.take_next()) ++taken;
    }
    CHECK(taken == limits::kHeldCommands);
  }
}

TEST_CASE("a command is sent at once, again after growing pauses, and never after its answer") {
  SendWindow client;
  client.add(MessageKind::set_gravity, payload(1), kWindowStart);
  std::vector<Time> sends;
  int resends = 0;
  const auto live_until = [&](Time end, Time now) {
    for (; now < end; now += 1ms) {
      resends += client.send_due(now, [&](MessageKind kind, ByteView bytes) {
        CHECK(kind == MessageKind::set_gravity);
        CHECK(Bytes(bytes.begin(), bytes.end()) == payload(1));
        sends.push_back(now);
      });
    }
  };
  live_until(kWindowStart + 5s, kWindowStart);
  REQUIRE(sends.size() > 10);
  CHECK(sends.size() < 50);  // no storm: ten a second at most
  CHECK(resends == static_cast<int>(sends.size()) - 1);
  CHECK(sends[0] == kWindowStart);
  for (std::size_t i = 2; i < sends.size(); ++i) {
    CHECK(sends[i] - sends[i - 1] >= sends[i - 1] - sends[i - 2]);
    CHECK(sends[i] - sends[i - 1] <= 1s);  // a client is forgotten after ten
  }
  CHECK(client.answer(receipt(1), kWindowStart + 5s) == SendWindow::Duration(5s));
  const std::size_t before = sends.size();
  live_until(kWindowStart + 10s, kWindowStart + 5s);
  CHECK(sends.size() == before);
}

namespace {

/// A client whose commands are answered when the test says so.
struct Conversation {
  SendWindow client;
  std::int64_t sequence = 0;
  Time now = kWindowStart;

  int send_due() {
    return client.send_due(now, [](MessageKind, ByteView) {});
  }
  void send() {
    client.add(MessageKind::set_gravity, payload(++sequence), now);
    send_due();
  }
  void exchange(SendWindow::Duration round_trip) {
    send();
    now += round_trip;
    client.answer(receipt(sequence), now);
  }
  /// How long until something is sent again.
  SendWindow::Duration pause() {
    const Time begin = now;
    while (send_due() == 0) now += 1ms;
    return now - begin;
  }
};

}  // namespace

TEST_CASE("the pause follows the round trip, and grows only while no answer comes") {
  Conversation talk;
  talk.send();
  CHECK(talk.pause() == 40ms);  // nothing known yet
  talk.client.answer(receipt(1), talk.now);
  CHECK(talk.client.round_trip() == 0ms);  // sent twice: no measure (Karn and Partridge 1987)
  for (int i = 0; i < 100; ++i) talk.exchange(1ms);
  CHECK(talk.client.round_trip() == 1ms);
  talk.send();
  CHECK(talk.pause() == 10ms);  // the shortest
  CHECK(talk.pause() == 10ms);  // fixed when it was sent
  CHECK(talk.pause() == 20ms);  // silence
  CHECK(talk.pause() == 40ms);
  talk.client.answer(receipt(talk.sequence), talk.now);
  talk.now += 1ms;
  talk.send();
  CHECK(talk.pause() == 10ms);
  talk.client.answer(receipt(talk.sequence), talk.now);
  for (int i = 0; i < 200; ++i) talk.exchange(30ms);
  talk.send();
  CHECK(talk.pause() >= 30ms);
  CHECK(talk.pause() <= 125ms);
}

TEST_CASE("what is overdue when a later command is answered is sent again at once") {
  Conversation talk;
  for (int i = 0; i < 100; ++i) talk.exchange(4ms);
  talk.send();
  talk.send();
  talk.now += 4ms;
  talk.client.answer(receipt(102, Result::held), talk.now);
  CHECK(talk.pause() == 2ms);  // as much as reordering is allowed
  talk.now += 4ms;
  talk.client.answer(receipt(101), talk.now);
  CHECK(talk.pause() <= 2ms);  // 102 was taken with it, and its receipt is lost
  talk.client.answer(receipt(102), talk.now);
  CHECK(talk.client.size() == 0);
}

TEST_CASE("what the server holds behind a gap is left alone while the gap is there") {
  Conversation talk;
  for (int i = 0; i < 100; ++i) talk.exchange(4ms);
  for (int i = 0; i < 10; ++i) talk.send();
  talk.now += 4ms;
  for (int s = 102; s <= 110; ++s) talk.client.answer(receipt(s, Result::held), talk.now);
  for (const Time end = talk.now + 1s; talk.now < end; talk.now += 1ms) {
    CHECK(talk.send_due() <= 1);  // 101 alone
  }
}

TEST_CASE("in silence only the oldest are sent again") {
  Conversation talk;
  for (int i = 0; i < 100; ++i) talk.send();
  talk.pause();
  int largest = 0;
  for (const Time end = talk.now + 1s; talk.now < end; talk.now += 1ms) {
    largest = std::max(largest, talk.send_due());
  }
  CHECK(largest == 16);
}

TEST_CASE("commands due together are sent oldest first") {
  SendWindow client;
  for (std::int64_t s = 1; s <= 5; ++s)
    client.add(MessageKind::set_gravity, payload(s), kWindowStart);
  std::vector<Bytes> sent;
  client.send_due(kWindowStart, [&](MessageKind, ByteView bytes) {
    sent.emplace_back(bytes.begin(), bytes.end());
  });
  CHECK(sent == std::vector<Bytes>{payload(1), payload(2), payload(3), payload(4), payload(5)});
}

TEST_CASE("queued, gap and busy leave a command pending, its final answer counts once") {
  SendWindow client;
  client.add(MessageKind::set_gravity, payload(1), kWindowStart);
  for (const Result result : {Result::gap, Result::busy, Result::queued}) {
    CHECK(!client.answer(receipt(1, result), kWindowStart + 1ms));
    CHECK(client.is_pending(1));
  }
  CHECK(client.answer(receipt(1, Result::unknown_body), kWindowStart + 3ms) ==
        SendWindow::Duration(3ms));
  CHECK(!client.answer(receipt(1), kWindowStart + 4ms));
  CHECK(!client.answer(receipt(2), kWindowStart + 4ms));  // never sent
  CHECK(client.size() == 0);
}

TEST_CASE("a restart gives up what is pending, and numbers go on") {
  SendWindow client;
  for (std::int64_t s = 1; s <= 4; ++s)
    client.add(MessageKind::set_gravity, payload(s), kWindowStart);
  client.answer(receipt(2), kWindowStart);
  client.restart();
  CHECK(client.next_sequence() == 5);
  CHECK(client.size() == 0);
  CHECK(!client.answer(receipt(3), kWindowStart));
  client.add(MessageKind::set_gravity, payload(5), kWindowStart);
  CHECK(client.is_pending(5));
}

}  // namespace cradle
