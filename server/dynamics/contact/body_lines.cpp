#include "server/dynamics/contact/body_lines.h"

#include <cstring>

#include "server/dynamics/gyroscopic.h"
#include "server/dynamics/rotation.h"

namespace cradle {

void BodyLines::begin(const ContactTick& tick, const BodyArrays& bodies,
                      std::span<const Matrix> inverse_inertia_W) {
  bodies_ = bodies;
  executor_ = tick.executor;
  islands_ = tick.islands;
  islands_count_ = tick.islands_count;
  moving_ = static_cast<std::int32_t>(tick.moving.size());
  driven_ = static_cast<std::int32_t>(tick.driven.size());
  const std::int32_t still = moving_ + driven_;
  line_of_slot_.assign(bodies.x.size(), still);
  wastes_ = moving_ / kBlockLanes + kBlockKinds;
  make_room();
  const auto enter = [&](std::int32_t line, std::int32_t slot) {
    const auto i = static_cast<std::size_t>(slot);
    line_of_slot_[i] = line;
    v(line) = bodies.v[i];
    w(line) = bodies.w[i];
  };
  for_moving([&](std::int32_t begin, std::int32_t end) {
    std::fill(velocities_.begin() + begin, velocities_.begin() + end, BodyLine{});
    std::fill(motions_.begin() + begin, motions_.begin() + end, BodyLine{});
    std::fill(struck_.begin() + begin, struck_.begin() + end, std::uint8_t{0});
    for (std::int32_t line = begin; line < end; ++line) {
      const std::int32_t slot = tick.moving[static_cast<std::size_t>(line)];
      enter(line, slot);
      State& state = at(states_, line);
      state.slot = static_cast<std::size_t>(slot);
      state.rests = !tick.resting.empty() && at(tick.resting, line) != 0;
      begin_line(line, inverse_inertia_W[static_cast<std::size_t>(slot)]);
      at(frees_, line) = at(velocities_, line);  // no contacts yet
    }
  });
  for (std::int32_t k = 0; k < driven_; ++k) {
    enter(moving_ + k, tick.driven[static_cast<std::size_t>(k)]);
  }
}

/// For all lines, of which those that do not yield begin with zeros. Batches differ in size: what
/// one of them has no use for is not given up, or else the next one would have to fill it again.
void BodyLines::make_room() {
  const auto grow = [](auto& all, std::size_t size) {
    if (all.size() < size) all.resize(size);
  };
  lines_ = static_cast<std::size_t>(moving_ + driven_ + 1 + wastes_);
  const auto clear_still = [&](auto& all) {
    grow(all, lines_);
    std::fill(all.begin() + moving_, all.begin() + static_cast<std::ptrdiff_t>(lines_),
              typename std::decay_t<decltype(all)>::value_type{});
  };
  clear_still(velocities_);
  clear_still(motions_);
  clear_still(struck_);
  grow(states_, moving());
  grow(turnings_, moving());
  for (std::vector<BodyLine>* all : {&loads_, &begins_, &frees_}) grow(*all, moving());
}

void BodyLines::begin_line(std::int32_t line, const Matrix& inverse_inertia_W) {
  State& state = at(states_, line);
  const std::size_t i = state.slot;
  state.turns = !bodies_.inverse_inertia[i].isZero(0);
  state.tumbles = state.turns && !has_equal_moments(bodies_.inertia[i]);
  state.is_twisted = state.turns && !bodies_.torque[i].isZero(0);
  state.mass = 1 / bodies_.inverse_mass[i];
  state.pull = bodies_.acceleration[i].norm();
  BodyLine& load = at(loads_, line);
  load = {};
  linear(load) = bodies_.acceleration[i];
  if (state.is_twisted && !state.tumbles) angular(load) = inverse_inertia_W * bodies_.torque[i];
  state.gyration2 = state.turns ? bodies_.inertia[i].maxCoeff() * bodies_.inverse_mass[i] : 0;
  Turning& turning = at(turnings_, line);
  if (!state.tumbles) return;
  turning.R_start = bodies_.q[i].toRotationMatrix();
  turning.axial_share = bodies_.axial_share.empty() ? 0 : bodies_.axial_share[i];
  if (turning.axial_share == 0) return;
  Eigen::Index along = 0;
  const Vector& J = bodies_.inertia[i];
  const Vector others(J.y() - J.z(), J.z() - J.x(), J.x() - J.y());
  others.cwiseAbs().minCoeff(&along);
  turning.axis = turning.R_start.col(along);
  turning.spin = 0;
  turning.frame = Rotation::Identity();
}

Vector BodyLines::arm_now(std::int32_t line, std::int32_t other, const Vector& arm,
                          const Vector& n) const {
  const double w2 = w(line).squaredNorm(), along_n = n.dot(w(line));
  if (w2 == 0) return arm;
  const Vector way = dp(other) - dp(line);
  return arm + along_n * along_n / w2 * (way - n * n.dot(way));
}

/// w after `h` without contacts, of a body that tumbles.
Vector BodyLines::free_turn(const State& state, const Turning& turning, const Vector& w,
                            double h) const {
  const Matrix& R = turning.R_start;
  const Vector& inverse_inertia = bodies_.inverse_inertia[state.slot];
  if (turning.axial_share != 0) {
    if (!state.is_twisted) return w;
    const Vector torque = turning.frame.conjugate() * bodies_.torque[state.slot];
    return w + h * R * Vector(inverse_inertia.cwiseProduct(Vector(R.transpose() * torque)));
  }
  Vector w_B = gyroscopic_step(R.transpose() * w, bodies_.inertia[state.slot], h);
  if (state.is_twisted) {
    const Vector torque_B = bodies_.q[state.slot].conjugate() * bodies_.torque[state.slot];
    w_B += h * inverse_inertia.cwiseProduct(torque_B);
  }
  return R * w_B;
}

void BodyLines::integrate_velocities(double h, double smooth_factor) {
  const double smooth_s = smooth_factor * h;
  for_moving([&](std::int32_t begin, std::int32_t end) {
    for (std::int32_t line = begin; line < end; ++line) {
      auto velocity = all(at(velocities_, line)), free = all(at(frees_, line));
      const AllOfLine by_contacts = velocity - free;
      all(at(begins_, line)) = velocity;
      free = velocity + h * all(at(loads_, line));
      const State& state = at(states_, line);
      if (state.tumbles)
        angular(at(frees_, line)) = free_turn(state, at(turnings_, line), w(line), h);
      velocity = free + by_contacts;
      note_if_struck(line, by_contacts, smooth_s);
    }
  });
  note_if_any_is_struck();
}

void BodyLines::note_if_any_is_struck() {
  has_struck_ = std::memchr(struck_.data(), 1, moving()) != nullptr;
}

void BodyLines::strike(std::int32_t line, const Vector& dv, const Vector& dw, double t) {
  const State& state = at(states_, line);
  linear(at(frees_, line)) += dv;  // no contact that a sub-step would warm start
  angular(at(frees_, line)) += dw;
  BodyLine& motion = at(motions_, line);
  linear(motion) -= t * dv;
  angular(motion) -= t * dw;
  if (state.tumbles) turn(state, at(turnings_, line), dw, -t);
}

/// The attitude of a body with unequal moments.
void BodyLines::turn(const State& state, Turning& turning, const Vector& w, double h) {
  Rotation& q = bodies_.q[state.slot];
  if (turning.axial_share == 0) {
    q = normalised(q * rotation_exp(h * (turning.R_start.transpose() * w)));
    return;
  }
  const double unseen = (1 - turning.axial_share) * turning.axis.dot(w);
  turning.spin += h * unseen;
  turning.frame = normalised(turning.frame * rotation_exp(h * (w - unseen * turning.axis)));
}

void BodyLines::displace(std::int32_t line, const BodyLine& by) {
  all(at(motions_, line)) += Eigen::Map<const AllOfLine>(by.all);
  const State& state = at(states_, line);
  if (state.tumbles) turn(state, at(turnings_, line), angular(by), 1);
}

void BodyLines::integrate_positions(double h, double smooth_factor) {
  const auto move = [&](std::int32_t line, const Vector& step, const Vector& angle) {
    BodyLine& motion = at(motions_, line);
    linear(motion) += step;
    angular(motion) += angle;
  };
  for_moving([&](std::int32_t begin, std::int32_t end) {
    for (std::int32_t line = begin; line < end; ++line) {
      const State& state = at(states_, line);
      const auto v_begin = linear(at(begins_, line)), w_begin = angular(at(begins_, line));
      const Vector change = v(line) - v_begin;
      const double smooth = smooth_factor * h * state.pull;
      const bool is_smooth = !state.rests && change.squaredNorm() <= smooth * smooth;
      const Vector step = h * (is_smooth ? Vector(v_begin + 0.5 * change) : Vector(v(line)));
      if (state.tumbles) turn(state, at(turnings_, line), w(line), h);
      if (state.tumbles || !state.turns) {  // the gyroscopic step is implicit, too
        move(line, step, h * w(line));
        continue;
      }
      const Vector spin = w(line) - w_begin;
      const bool turns_smoothly =
          is_smooth && state.gyration2 * spin.squaredNorm() <= smooth * smooth;
      move(line, step, h * (turns_smoothly ? Vector(w_begin + 0.5 * spin) : Vector(w(line))));
    }
  });
  for (std::int32_t line = moving_; line < moving_ + driven_; ++line) {
    move(line, h * v(line), h * w(line));
  }
}

/// Far from the origin a step is rounded to the same side tick by tick ("from the origin").
void BodyLines::move(std::size_t slot, const Vector& step) {
  if (bodies_.x_rest.empty()) {
    bodies_.x[slot] += step;
    return;
  }
  const Vector before = bodies_.x[slot], whole = step + bodies_.x_rest[slot];
  bodies_.x[slot] = before + whole;
  bodies_.x_rest[slot] = whole - (bodies_.x[slot] - before);
}

void BodyLines::finish() {
  for_moving([&](std::int32_t begin, std::int32_t end) {
    for (std::int32_t line = begin; line < end; ++line) {
      const State& state = at(states_, line);
      const Turning& turning = at(turnings_, line);
      Rotation& q = bodies_.q[state.slot];
      move(state.slot, dp(line));
      bodies_.v[state.slot] = v(line);
      if (!state.turns) continue;
      if (state.tumbles && turning.axial_share != 0) {
        q = normalised(turning.frame * rotation_exp(turning.spin * turning.axis) * q);
        bodies_.w[state.slot] = turning.frame * Vector(w(line));
        continue;
      }
      if (!state.tumbles) q = normalised(rotation_exp(theta(line)) * q);
      bodies_.w[state.slot] =
          state.tumbles ? Vector(q * (turning.R_start.transpose() * w(line))) : Vector(w(line));
    }
  });
}

}  // namespace cradle
