/// Messages of every kind with random values that the codec must carry, and their bytes.
#pragma once

#include <cradle/limits.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>
#include <random>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "protocol/codec.h"

namespace cradle::test {

inline constexpr std::array kAllKinds = {
    MessageKind::hello,          MessageKind::spawn,      MessageKind::despawn,
    MessageKind::push,           MessageKind::set_motion, MessageKind::set_gravity,
    MessageKind::clear_wrenches, MessageKind::control,    MessageKind::receipts,
    MessageKind::status,         MessageKind::states,     MessageKind::events};
static_assert(kAllKinds.size() == kMessageKinds);

using Message = std::variant<Command, Receipts, WorldStatus, StateChunk, Events>;

inline Bytes bytes_of(const Message& message) {
  return std::visit([](const auto& m) { return encode(m); }, message);
}

inline std::optional<Message> decode(MessageKind kind, ByteView payload) {
  switch (kind) {
    case MessageKind::receipts:
      return decode_receipts(payload);
    case MessageKind::status:
      return decode_status(payload);
    case MessageKind::states:
      return decode_states(payload);
    case MessageKind::events:
      return decode_events(payload);
    default:
      return decode_command(kind, payload);
  }
}

class Samples {
 public:
  explicit Samples(std::uint64_t seed) : random_(seed) {}

  /// Of a kind without items, `items` is ignored.
  Message message(MessageKind kind, std::size_t items) {
    switch (kind) {
      case MessageKind::receipts:
        return Receipts{integer(1), list(items, [this] { return receipt(); })};
      case MessageKind::status:
        return status();
      case MessageKind::states:
        return states(items);
      case MessageKind::events:
        return Events{integer(1), integer(), list(items, [this] { return event(); })};
      default:
        return Command{{integer(1), integer(1), integer(), integer()}, body(kind, items)};
    }
  }

  std::uint64_t bits() { return random_(); }
  std::size_t below(std::size_t end) { return static_cast<std::size_t>(bits() % end); }

 private:
  template <class Make>
  static std::vector<std::invoke_result_t<Make>> list(std::size_t count, Make make) {
    std::vector<std::invoke_result_t<Make>> all;
    while (all.size() < count) all.push_back(make());
    return all;
  }

  bool coin() { return bits() % 2 == 0; }

  /// lowest .. 2^53 - 1, its ends often.
  std::int64_t integer(std::int64_t lowest = 0) {
    switch (bits() % 4) {
      case 0:
        return lowest;
      case 1:
        return limits::kIntegerMax;
      default:
        return lowest + static_cast<std::int64_t>(bits() % (1ULL << 52));
    }
  }
  std::int32_t small_integer() { return static_cast<std::int32_t>(bits() % (1ULL << 31)); }

  /// Any double that is equal to itself: tiny, huge and infinite ones too.
  double number() {
    const auto value = std::bit_cast<double>(bits());
    return std::isnan(value) ? -0.0 : value;
  }
  Vec3 vector() { return {number(), number(), number()}; }
  Quat rotation() { return {number(), number(), number(), number()}; }

  template <class Enum>
  Enum one_of(Enum last) {
    return static_cast<Enum>(below(static_cast<std::size_t>(last) + 1));
  }
  Result result() {
    while (true) {
      const auto candidate = static_cast<Result>(below(128));
      if (to_string(candidate) != "unlisted") return candidate;
    }
  }
  std::string name() {
    std::string text(below(limits::kNameBytes + 1), ' ');
    for (char& c : text) c = static_cast<char>(1 + below(255));
    return text;
  }
  Shape shape() {
    Shape s{one_of(ShapeKind::height_field), {}};
    for (double& p : s.parameters) p = number();
    return s;
  }

  BodySpec spec() {
    BodySpec s;
    s.kind = one_of(BodyKind::dynamic);
    s.shape = shape();
    s.mass_kg = number();
    s.density_kgpm3 = number();
    s.inertia_kgm2 = vector();
    s.inertia_products_kgm2 = vector();
    s.sets_centre_of_mass = coin();
    s.p_BoBcm = vector();
    s.material = {number(),
                  number(),
                  number(),
                  number(),
                  one_of(CombineRule::maximum),
                  one_of(CombineRule::maximum)};
    s.contact_tolerance_m = number();
    s.p_WBo = vector();
    s.q_WB = rotation();
    s.v_WBcm = vector();
    s.w_WB = vector();
    s.name = name();
    return s;
  }
  Wrench wrench() {
    Wrench w;
    w.body = {integer()};
    w.quantity = one_of(WrenchQuantity::acceleration);
    w.frame = one_of(WrenchFrame::body);
    w.point_kind = one_of(WrenchPoint::body_point);
    w.duration = one_of(WrenchDuration::until_cleared);
    w.ticks = integer();
    w.value = vector();
    w.point = vector();
    return w;
  }
  Motion motion() {
    return {{integer()}, coin(), coin(), vector(), rotation(), vector(), vector()};
  }
  Receipt receipt() {
    return {integer(), integer(), integer(), {result(), {integer()}, small_integer()}};
  }
  Event event() {
    Event e;
    e.kind = one_of(EventKind::woke);
    e.body = {integer(1)};
    e.client = integer();
    e.tick = integer();
    e.reason = result();
    e.body_kind = one_of(BodyKind::dynamic);
    e.shape = shape();
    e.mass_kg = number();
    e.p_BoBcm = vector();
    e.name = name();
    return e;
  }

  CommandBody body(MessageKind kind, std::size_t items) {
    const auto id = [this] { return BodyId{integer()}; };
    switch (kind) {
      case MessageKind::hello:
        return Hello{static_cast<std::int32_t>(bits()), name()};
      case MessageKind::spawn:
        return Spawn{list(items, [this] { return spec(); })};
      case MessageKind::despawn:
        return Despawn{list(items, id)};
      case MessageKind::push:
        return Push{list(items, [this] { return wrench(); })};
      case MessageKind::clear_wrenches:
        return ClearWrenches{list(items, id)};
      case MessageKind::set_motion:
        return SetMotion{list(items, [this] { return motion(); })};
      case MessageKind::set_gravity:
        return SetGravity{vector()};
      default:
        return Control{one_of(ControlAction::shutdown), integer()};
    }
  }

  WorldStatus status() {
    WorldStatus s;
    s.protocol_version = static_cast<std::int32_t>(bits());
    for (bool* flag : {&s.paused, &s.lockstep, &s.overloaded, &s.controllable, &s.contested})
      *flag = coin();
    s.epoch = integer(1);
    for (std::int64_t* count :
         {&s.tick, &s.tick_time_us, &s.bodies, &s.contacts, &s.clients, &s.wrenches, &s.overruns,
          &s.commands_applied, &s.commands_refused, &s.datagrams_rejected, &s.datagrams_dropped,
          &s.chunks_dropped, &s.quarantined, &s.islands, &s.balance_tick}) {
      *count = integer();
    }
    for (double* value : {&s.rate_hz,
                          &s.real_time_factor,
                          &s.apply_us,
                          &s.collide_us,
                          &s.solve_us,
                          &s.publish_us,
                          &s.penetration_max_m,
                          &s.penetration_mean_m,
                          &s.sag_expected_m,
                          &s.residual_mps,
                          &s.residual_relative,
                          &s.residual_signorini_mps,
                          &s.residual_cone_mps,
                          &s.residual_complementarity_J,
                          &s.kinetic_change_J,
                          &s.work_gravity_J,
                          &s.work_wrenches_J,
                          &s.work_friction_J,
                          &s.work_impacts_J,
                          &s.work_driven_J,
                          &s.energy_unaccounted_J,
                          &s.momentum_unaccounted_Ns}) {
      *value = number();
    }
    s.sub_steps_max = small_integer();
    s.impacts = small_integer();
    s.state_port = small_integer();
    s.datagram_bytes = small_integer();
    s.receive_buffer_bytes = small_integer();
    s.name = name();
    return s;
  }

  StateChunk states(std::size_t items) {
    StateChunk c;
    c.epoch = integer(1);
    c.tick = integer();
    c.tick_time_us = integer();
    c.sent_us = integer();
    c.chunks = 1 + small_integer() / 2;
    c.chunk = static_cast<std::int32_t>(below(static_cast<std::size_t>(c.chunks)));
    c.first_body = {1 + static_cast<std::int64_t>(below(1000))};
    std::int64_t id = c.first_body.value - 1;
    for (std::size_t i = 0; i < items; ++i) {
      BodyState s;
      s.body = {id += 1 + static_cast<std::int64_t>(below(5))};
      s.kind = one_of(BodyKind::dynamic);
      s.in_contact = coin();
      s.quarantined = coin();
      s.asleep = coin();
      s.p_WBo = vector();
      s.q_WB = rotation();
      s.v_WBcm = vector();
      s.w_WB = vector();
      c.states.push_back(s);
    }
    c.last_body = {std::max(c.first_body.value, id) + static_cast<std::int64_t>(below(5))};
    return c;
  }

  std::mt19937_64 random_;
};

// Big-endian fields of a payload.
template <class Integer>
void write_field(Bytes& payload, std::size_t at, Integer value) {
  for (std::size_t i = 0; i < sizeof value; ++i) {
    payload.at(at + i) = static_cast<std::uint8_t>(value >> 8 * (sizeof value - 1 - i));
  }
}

template <class Integer>
Integer read_field(const Bytes& payload, std::size_t at) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(Integer); ++i) value = value << 8 | payload.at(at + i);
  return static_cast<Integer>(value);
}

}  // namespace cradle::test
