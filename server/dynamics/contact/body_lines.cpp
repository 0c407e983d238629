#include "server/dynamics/contact/body_lines.h"

#include "server/dynamics/gyroscopic.h"
#include "server/dynamics/rotation.h"

namespace cradle {

void BodyLines::begin(const ContactTick& tick, const BodyArrays& bodies,
                      std::span<const Matrix> inverse_inertia_W) {
  bodies_ = bodies;
  has_begun_ = false;
  moving_ = static_cast<std::int32_t>(tick.moving.size());
  driven_ = static_cast<std::int32_t>(tick.driven.size());
  const std::int32_t still = moving_ + driven_;
  line_of_slot_.assign(bodies.x.size(), still);
  velocities_.assign(static_cast<std::size_t>(still) + 2, BodyLine{});
  motions_.assign(velocities_.size(), BodyLine{});
  states_.resize(moving());
  const auto enter = [&](std::int32_t line, std::int32_t slot) {
    const auto i = static_cast<std::size_t>(slot);
    line_of_slot_[i] = line;
    v(line) = bodies.v[i];
    w(line) = bodies.w[i];
  };
  for (std::int32_t line = 0; line < moving_; ++line) {
    const std::int32_t slot = tick.moving[static_cast<std::size_t>(line)];
    enter(line, slot);
    const auto i = static_cast<std::size_t>(slot);
    State& state = at(states_, line);
    state.slot = i;
    state.turns = !bodies.inverse_inertia[i].isZero(0);
    state.tumbles = state.turns && !has_equal_moments(bodies.inertia[i]);
    state.is_twisted = state.turns && !bodies.torque[i].isZero(0);
    if (state.tumbles) state.R_start = bodies.q[i].toRotationMatrix();
    state.axial_share = state.tumbles && !bodies.axial_share.empty() ? bodies.axial_share[i] : 0;
    if (state.axial_share != 0) {
      Eigen::Index along = 0;
      const Vector& J = bodies.inertia[i];
      const Vector others(J.y() - J.z(), J.z() - J.x(), J.x() - J.y());
      others.cwiseAbs().minCoeff(&along);
      state.axis = state.R_start.col(along);
      state.spin = 0;
      state.frame = Rotation::Identity();
    }
    if (state.is_twisted) state.turn_by_torque = inverse_inertia_W[i] * bodies.torque[i];
  }
  for (std::int32_t k = 0; k < driven_; ++k) {
    enter(moving_ + k, tick.driven[static_cast<std::size_t>(k)]);
  }
}

/// w after `h` without contacts.
Vector BodyLines::free_turn(const State& state, const Vector& w, double h) const {
  if (!state.tumbles) return state.is_twisted ? Vector(w + h * state.turn_by_torque) : w;
  if (state.axial_share != 0) {
    if (!state.is_twisted) return w;
    const Vector torque = state.frame.conjugate() * bodies_.torque[state.slot];
    const Vector torque_P = state.R_start.transpose() * torque;
    return w +
           h * state.R_start * Vector(bodies_.inverse_inertia[state.slot].cwiseProduct(torque_P));
  }
  const Vector& J = bodies_.inertia[state.slot];
  Vector w_B = gyroscopic_step(state.R_start.transpose() * w, J, h);
  if (state.is_twisted) {
    const Vector torque_B = bodies_.q[state.slot].conjugate() * bodies_.torque[state.slot];
    w_B += h * bodies_.inverse_inertia[state.slot].cwiseProduct(torque_B);
  }
  return state.R_start * w_B;
}

void BodyLines::integrate_velocities(double h) {
  for (std::int32_t line = 0; line < moving_; ++line) {
    State& state = at(states_, line);
    auto v = this->v(line), w = this->w(line);
    const Vector by_contacts = has_begun_ ? Vector(v - state.v_free) : Vector::Zero();
    state.v_begin = v;
    state.v_free = v + h * bodies_.acceleration[state.slot];
    v = state.v_free + by_contacts;
    if (!state.turns) continue;
    const Vector turn_by_contacts = has_begun_ ? Vector(w - state.w_free) : Vector::Zero();
    state.w_free = free_turn(state, w, h);
    w = state.w_free + turn_by_contacts;
  }
  has_begun_ = true;
}

/// The attitude of a body with unequal moments.
void BodyLines::turn(State& state, const Vector& w, double h) {
  Rotation& q = bodies_.q[state.slot];
  if (state.axial_share == 0) {
    q = normalised(q * rotation_exp(h * (state.R_start.transpose() * w)));
    return;
  }
  const double unseen = (1 - state.axial_share) * state.axis.dot(w);
  state.spin += h * unseen;
  state.frame = normalised(state.frame * rotation_exp(h * (w - unseen * state.axis)));
}

void BodyLines::integrate_positions(double h, double smooth_factor) {
  const auto move = [&](std::int32_t line, const Vector& step) {
    BodyLine& motion = at(motions_, line);
    Eigen::Map<Vector>(motion.linear) += step;
    Eigen::Map<Vector>(motion.angular) += h * w(line);
  };
  for (std::int32_t line = 0; line < moving_; ++line) {
    const State& state = at(states_, line);
    const Vector change = v(line) - state.v_begin;
    const double smooth = smooth_factor * h * bodies_.acceleration[state.slot].norm();
    const bool is_smooth = change.squaredNorm() <= smooth * smooth;
    move(line, h * (is_smooth ? Vector(state.v_begin + 0.5 * change) : Vector(v(line))));
    if (state.tumbles) turn(at(states_, line), w(line), h);
  }
  for (std::int32_t line = moving_; line < moving_ + driven_; ++line) move(line, h * v(line));
}

void BodyLines::finish() {
  for (std::int32_t line = 0; line < moving_; ++line) {
    const State& state = at(states_, line);
    Rotation& q = bodies_.q[state.slot];
    bodies_.x[state.slot] += dp(line);
    bodies_.v[state.slot] = v(line);
    if (!state.turns) continue;
    if (state.axial_share != 0) {
      q = normalised(state.frame * rotation_exp(state.spin * state.axis) * q);
      bodies_.w[state.slot] = state.frame * Vector(w(line));
      continue;
    }
    if (!state.tumbles) q = normalised(rotation_exp(theta(line)) * q);
    bodies_.w[state.slot] =
        state.tumbles ? Vector(q * (state.R_start.transpose() * w(line))) : Vector(w(line));
  }
}

}  // namespace cradle
