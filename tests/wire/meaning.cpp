// Well-formed bytes whose fields mean nothing: unknown enumerators and flags, numbers beyond what a
// double counts, names without their padding, chunks that contradict themselves.
#include <catch2/catch.hpp>
#include <functional>
#include <limits>
#include <utility>

#include "tests/wire/layout.h"
#include "tests/wire/samples.h"

namespace cradle::test {
namespace {

constexpr std::int64_t kMax = limits::kIntegerMax;  // 2^53 - 1

template <class Value>
Value sample(MessageKind kind, std::size_t items = 2) {
  return std::get<Value>(Samples(21).message(kind, items));
}
template <class Body>
Body command(MessageKind kind) {
  return std::get<Body>(sample<Command>(kind).body);
}

bool decodes(const Command& c) { return decode_command(kind_of(c.body), encode(c)).has_value(); }
bool decodes(const CommandBody& body) { return decodes(Command{{1, 1, 0, 0}, body}); }
bool decodes(const Receipts& m) { return decode_receipts(encode(m)).has_value(); }
bool decodes(const WorldStatus& m) { return decode_status(encode(m)).has_value(); }
bool decodes(const StateChunk& m) { return decode_states(encode(m)).has_value(); }
bool decodes(const Events& m) { return decode_events(encode(m)).has_value(); }

/// True if `field` of `message` may be lowest .. highest, and nothing beyond.
template <class Message, class Integer>
bool has_range(Message& message, Integer& field, std::int64_t lowest, std::int64_t highest) {
  const auto is_taken = [&](std::int64_t value) {
    const Integer before = std::exchange(field, static_cast<Integer>(value));
    const bool result = decodes(message);
    field = before;
    return result;
  };
  return is_taken(lowest) && is_taken(highest) && !is_taken(lowest - 1) && !is_taken(highest + 1) &&
         !is_taken(std::numeric_limits<Integer>::min());
}
template <class Message, class Enum>
bool has_last(Message& message, Enum& field, Enum last) {
  static_assert(std::is_enum_v<Enum>);
  const auto is_taken = [&](std::int64_t value) {
    const Enum before = std::exchange(field, static_cast<Enum>(value));
    const bool result = decodes(message);
    field = before;
    return result;
  };
  const auto highest = static_cast<std::int64_t>(last);
  return is_taken(0) && is_taken(highest) && !is_taken(-1) && !is_taken(highest + 1) &&
         !is_taken(0x7fffffff);
}

/// A legal payload, its 32 bits at `at` replaced.
Bytes patched(Bytes payload, std::size_t at, std::int32_t value) {
  write_field(payload, at, value);
  return payload;
}

}  // namespace

TEST_CASE("headers of commands stay within 2^53 - 1, clients and sequences begin at 1") {
  for (const MessageKind kind : kAllKinds) {
    if (!is_command(kind)) continue;
    CAPTURE(static_cast<int>(kind));
    auto c = sample<Command>(kind);
    CHECK(has_range(c, c.header.client, 1, kMax));
    CHECK(has_range(c, c.header.sequence, 1, kMax));
    CHECK(has_range(c, c.header.epoch, 0, kMax));
    CHECK(has_range(c, c.header.target_tick, 0, kMax));
  }
}

TEST_CASE("a header that no receipt could repeat cannot be read on its own either") {
  // Its numbers would make the receipts of everybody else in the same datagram unreadable.
  const Command good{{7, 8, 9, 0}, SetGravity{}};
  CHECK(peek_header(MessageKind::set_gravity, encode(good)));
  for (const CommandHeader& bad : {CommandHeader{0, 8, 9, 0}, CommandHeader{7, -8, 9, 0},
                                   CommandHeader{kMax + 1, 8, 9, 0}, CommandHeader{7, 8, 9, -1}}) {
    CHECK(!peek_header(MessageKind::set_gravity, encode(Command{bad, SetGravity{}})));
  }
}

TEST_CASE("unknown enumerators and impossible ids are refused in commands") {
  auto spawn = command<Spawn>(MessageKind::spawn);
  CHECK(has_last(spawn, spawn.bodies[1].kind, BodyKind::dynamic));
  CHECK(has_last(spawn, spawn.bodies[1].shape.kind, ShapeKind::polygon));
  CHECK(has_last(spawn, spawn.bodies[1].material.friction_rule, CombineRule::maximum));
  CHECK(has_last(spawn, spawn.bodies[1].material.restitution_rule, CombineRule::maximum));

  auto push = command<Push>(MessageKind::push);
  Wrench& wrench = push.wrenches[1];
  CHECK(has_last(push, wrench.quantity, WrenchQuantity::acceleration));
  CHECK(has_last(push, wrench.frame, WrenchFrame::body));
  CHECK(has_last(push, wrench.point_kind, WrenchPoint::body_point));
  CHECK(has_last(push, wrench.duration, WrenchDuration::until_cleared));
  CHECK(has_range(push, wrench.body.value, 0, kMax));
  CHECK(has_range(push, wrench.ticks, 0, kMax));

  auto despawn = command<Despawn>(MessageKind::despawn);
  CHECK(has_range(despawn, despawn.bodies[1].value, 0, kMax));
  auto clear = command<ClearWrenches>(MessageKind::clear_wrenches);
  CHECK(has_range(clear, clear.bodies[1].value, 0, kMax));
  auto motion = command<SetMotion>(MessageKind::set_motion);
  CHECK(has_range(motion, motion.motions[1].body.value, 0, kMax));

  auto control = command<Control>(MessageKind::control);
  CHECK(has_last(control, control.action, ControlAction::shutdown));
  CHECK(has_range(control, control.steps, 0, kMax));
}

TEST_CASE("unknown enumerators and impossible numbers are refused in what the server says") {
  auto receipts = sample<Receipts>(MessageKind::receipts);
  Receipt& receipt = receipts.receipts[1];
  CHECK(has_range(receipts, receipts.epoch, 1, kMax));
  CHECK(has_range(receipts, receipt.client, 0, kMax));
  CHECK(has_range(receipts, receipt.sequence, 0, kMax));
  CHECK(has_range(receipts, receipt.tick, 0, kMax));
  CHECK(has_range(receipts, receipt.outcome.body.value, 0, kMax));
  for (const std::int32_t item : {-1, std::numeric_limits<std::int32_t>::min()}) {
    receipt.outcome.item = item;
    CHECK(!decodes(receipts));
  }

  auto events = sample<Events>(MessageKind::events);
  Event& event = events.events[1];
  CHECK(has_last(events, event.kind, EventKind::woke));
  CHECK(has_last(events, event.body_kind, BodyKind::dynamic));
  CHECK(has_last(events, event.shape.kind, ShapeKind::polygon));
  CHECK(has_range(events, events.epoch, 1, kMax));
  CHECK(has_range(events, events.first, 0, kMax));
  CHECK(has_range(events, event.body.value, 1, kMax));
  CHECK(has_range(events, event.client, 0, kMax));
  CHECK(has_range(events, event.tick, 0, kMax));

  auto chunk = sample<StateChunk>(MessageKind::states, 0);
  CHECK(has_range(chunk, chunk.epoch, 1, kMax));
  CHECK(has_range(chunk, chunk.tick, 0, kMax));
  CHECK(has_range(chunk, chunk.tick_time_us, 0, kMax));
  CHECK(has_range(chunk, chunk.sent_us, 0, kMax));
  CHECK(has_range(chunk, chunk.first_body.value, 0, kMax));
  CHECK(has_range(chunk, chunk.last_body.value, 0, kMax));
  auto states = sample<StateChunk>(MessageKind::states);
  CHECK(has_last(states, states.states[1].kind, BodyKind::dynamic));
}

TEST_CASE("the counts of a status are not negative and stay within 2^53 - 1") {
  auto s = sample<WorldStatus>(MessageKind::status);
  CHECK(has_range(s, s.epoch, 1, kMax));
  for (std::int64_t* count :
       {&s.tick, &s.tick_time_us, &s.bodies, &s.contacts, &s.clients, &s.wrenches, &s.overruns,
        &s.commands_applied, &s.commands_refused, &s.datagrams_rejected, &s.datagrams_dropped,
        &s.chunks_dropped, &s.quarantined}) {
    CHECK(has_range(s, *count, 0, kMax));
  }
  for (std::int32_t* count : {&s.state_port, &s.datagram_bytes, &s.receive_buffer_bytes}) {
    CHECK(std::exchange(*count, -1) >= 0);
    CHECK(!decodes(s));
    *count = 0;
  }
  CHECK(decodes(s));
}

TEST_CASE("a result that is not listed is refused, every listed one is taken") {
  auto receipts = sample<Receipts>(MessageKind::receipts);
  auto events = sample<Events>(MessageKind::events);
  int listed = 0;
  for (std::int32_t code = -3; code < 1000; ++code) {
    receipts.receipts[1].outcome.result = static_cast<Result>(code);
    events.events[1].reason = static_cast<Result>(code);
    const bool is_listed = to_string(static_cast<Result>(code)) != "unlisted";
    CAPTURE(code);
    CHECK(decodes(receipts) == is_listed);
    CHECK(decodes(events) == is_listed);
    listed += is_listed;
  }
  CHECK(listed == 36);  // the enumerators of result.h, counted
}

TEST_CASE("unknown flags are refused") {
  const std::size_t motion_what = layout_of(MessageKind::set_motion).fixed + 8;
  const std::size_t state_flags = layout_of(MessageKind::states).fixed + 8 + 4;
  constexpr std::size_t kStatusFlags = kFingerprintBytes + 4;
  const std::size_t spawn_sets = layout_of(MessageKind::spawn).fixed + 2 * 4;  // kind, shape
  const Bytes spawn = encode(sample<Command>(MessageKind::spawn));
  const Bytes motion = encode(sample<Command>(MessageKind::set_motion));
  const Bytes states = encode(sample<StateChunk>(MessageKind::states));
  const Bytes status = encode(sample<WorldStatus>(MessageKind::status));
  for (std::int32_t flags = 0; flags < 64; ++flags) {
    CAPTURE(flags);
    const bool is_of_two = flags < 4;
    CHECK(decode_command(MessageKind::spawn, patched(spawn, spawn_sets, flags)).has_value() ==
          (flags < 2));
    CHECK(decode_command(MessageKind::set_motion, patched(motion, motion_what + 4, flags))
              .has_value() == is_of_two);
    CHECK(decode_states(patched(states, state_flags, flags)).has_value() == (flags < 8));
    CHECK(decode_status(patched(status, kStatusFlags, flags)).has_value() == (flags < 32));
  }
  CHECK(!decode_command(MessageKind::spawn, patched(spawn, spawn_sets, -1)));
  CHECK(!decode_command(MessageKind::set_motion, patched(motion, motion_what, -1)));
  CHECK(!decode_states(patched(states, state_flags, -1)));
  CHECK(!decode_status(patched(status, kStatusFlags, -1)));
}

TEST_CASE("a name that is not followed by zeros to its end is refused") {
  // In these messages the name comes last.
  for (const MessageKind kind :
       {MessageKind::hello, MessageKind::spawn, MessageKind::status, MessageKind::events}) {
    CAPTURE(static_cast<int>(kind));
    Bytes payload = bytes_of(Samples(22).message(kind, 2));
    const auto name = payload.end() - kNameBytes;
    std::fill(name, payload.end(), std::uint8_t{'x'});
    CHECK(!decode(kind, payload));  // no zero at all
    name[31] = 0;
    CHECK(decode(kind, payload));
    name[20] = 0;
    CHECK(!decode(kind, payload));  // something behind the zero
    std::fill(name, payload.end(), std::uint8_t{0});
    CHECK(decode(kind, payload));
  }
}

TEST_CASE("a name longer than the field is cut, not written beyond it") {
  const Command c{{1, 1, 0, 0}, Hello{1, std::string(100, 'n')}};
  const auto back = decode_command(MessageKind::hello, encode(c));
  REQUIRE(back);
  CHECK(std::get<Hello>(back->body).name == std::string(limits::kNameBytes, 'n'));
}

TEST_CASE("a chunk's states ascend, lie in its range, and its number is one of its tick's") {
  StateChunk good = sample<StateChunk>(MessageKind::states, 3);
  good.first_body = {10};
  good.last_body = {30};
  for (std::size_t i = 0; i < 3; ++i) good.states[i].body = {10 + 10 * static_cast<int>(i)};
  good.chunk = 1;
  good.chunks = 2;
  CHECK(decodes(good));
  const auto is_refused = [&](const std::function<void(StateChunk&)>& spoil) {
    StateChunk bad = good;
    spoil(bad);
    return !decodes(bad);
  };
  CHECK(is_refused([](auto& c) { std::swap(c.states[0].body, c.states[1].body); }));
  CHECK(is_refused([](auto& c) { c.states[1].body = c.states[0].body; }));
  CHECK(is_refused([](auto& c) { c.first_body = {11}; }));
  CHECK(is_refused([](auto& c) { c.last_body = {29}; }));
  CHECK(is_refused([](auto& c) { c.chunk = 2; }));
  CHECK(is_refused([](auto& c) { c.chunk = -1; }));
  CHECK(is_refused([](auto& c) { c.chunks = 0; }));
  CHECK(is_refused([](auto& c) { c.first_body = {0}, c.states[0].body = {0}; }));
}

}  // namespace cradle::test
