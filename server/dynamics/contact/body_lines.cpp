#include "server/dynamics/contact/body_lines.h"

#include <limits>

#include "server/dynamics/contact/contact_kernels.h"
#include "server/dynamics/gyroscopic.h"
#include "server/dynamics/rotation.h"

namespace cradle {

void BodyLines::begin(const ContactTick& tick, const BodyArrays& bodies,
                      std::span<const Matrix> inverse_inertia_W) {
  bodies_ = bodies;
  executor_ = tick.executor;
  kernels_ = &contact_kernels_of(tick.lanes);
  islands_ = tick.islands;
  islands_count_ = tick.islands_count;
  heaps_ = tick.heaps;
  domains_ = tick.domains;
  places_ = tick.places;
  tasks_ = TaskTree(tick.domains_count);
  moving_ = static_cast<std::int32_t>(tick.moving.size());
  driven_ = static_cast<std::int32_t>(tick.driven.size());
  const std::int32_t still = moving_ + driven_;
  line_of_slot_.assign(bodies.x.size(), still);
  make_room();
  const auto enter = [&](std::int32_t line, std::int32_t slot) {
    const auto i = static_cast<std::size_t>(slot);
    line_of_slot_[i] = line;
    v(line) = bodies.v[i];
    w(line) = bodies.w[i];
  };
  for_moving([&](std::int32_t begin, std::int32_t end) {
    std::fill(motions_.begin() + begin, motions_.begin() + end, BodyLine{});
    std::fill(struck_.begin() + begin, struck_.begin() + end, 0);
    for (std::int32_t line = begin; line < end; ++line) {
      const std::int32_t slot = tick.moving[static_cast<std::size_t>(line)];
      enter(line, slot);
      State& state = at(states_, line);
      state.slot = static_cast<std::size_t>(slot);
      const bool rests = !tick.resting.empty() && at(tick.resting, line) != 0;
      begin_line(line, rests, inverse_inertia_W[static_cast<std::size_t>(slot)]);
      at(frees_, line) = at(velocities_, line);  // no contacts yet
    }
  });
  tumbling_.clear();
  twisted_.clear();
  for (std::int32_t line = 0; line < moving_; ++line) {
    if (at(states_, line).tumbles) tumbling_.push_back(line);
    if (at(states_, line).is_twisted) twisted_.push_back(line);
  }
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
  lines_ = static_cast<std::size_t>(moving_ + driven_ + 1) + tasks_.tasks();
  const auto clear_still = [&](auto& all) {
    grow(all, lines_);
    std::fill(all.begin() + moving_, all.begin() + static_cast<std::ptrdiff_t>(lines_),
              typename std::decay_t<decltype(all)>::value_type{});
  };
  clear_still(velocities_);
  clear_still(motions_);
  clear_still(responses_);
  clear_still(struck_);
  grow(states_, moving());
  grow(turnings_, moving());
  for (std::vector<BodyLine>* all : {&loads_, &begins_, &frees_}) grow(*all, moving());
  for (std::vector<double>* all :
       {&pull2_, &gyration2_, &mean_pull2_, &mean_gyration2_, &masses_, &gains_}) {
    grow(*all, moving());
  }
}

void BodyLines::begin_line(std::int32_t line, bool rests, const Matrix& inverse_inertia_W) {
  State& state = at(states_, line);
  const std::size_t i = state.slot;
  state.turns = !bodies_.inverse_inertia[i].isZero(0);
  state.tumbles = state.turns && !has_equal_moments(bodies_.inertia[i]);
  state.is_twisted = state.turns && !bodies_.torque[i].isZero(0);
  at(masses_, line) = 1 / bodies_.inverse_mass[i];
  at(pull2_, line) = bodies_.acceleration[i].squaredNorm();
  at(mean_pull2_, line) = rests ? -1 : at(pull2_, line);
  at(gyration2_, line) = state.turns ? bodies_.inertia[i].maxCoeff() * bodies_.inverse_mass[i] : 0;
  // The gyroscopic step is implicit, too.
  at(mean_gyration2_, line) =
      state.tumbles ? std::numeric_limits<double>::infinity() : at(gyration2_, line);
  const Matrix& I = inverse_inertia_W;
  at(responses_, line) = {{I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2), 0, 0}};
  at(velocities_, line).all[kInverseMass] = bodies_.inverse_mass[i];
  state.is_round = has_equal_moments(bodies_.inverse_inertia[i]);
  at(velocities_, line).all[kInverseMoment] = state.is_round ? bodies_.inverse_inertia[i].x() : 0;
  BodyLine& load = at(loads_, line);
  load = {};
  linear(load) = bodies_.acceleration[i];
  if (state.is_twisted && !state.tumbles) angular(load) = inverse_inertia_W * bodies_.torque[i];
  Turning& turning = at(turnings_, line);
  if (!state.tumbles) return;
  turning.q = bodies_.q[i];
  turning.R_start = turning.q.toRotationMatrix();
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
    const Vector torque_B = turning.q.conjugate() * bodies_.torque[state.slot];
    w_B += h * inverse_inertia.cwiseProduct(torque_B);
  }
  return R * w_B;
}

BodyRun BodyLines::run(std::int32_t begin, std::int32_t end) {
  return {velocities_.data(),
          motions_.data(),
          begins_.data(),
          frees_.data(),
          loads_.data(),
          pull2_.data(),
          gyration2_.data(),
          mean_pull2_.data(),
          mean_gyration2_.data(),
          masses_.data(),
          struck_.data(),
          gains_.data(),
          begin,
          end};
}

std::span<const std::int32_t> BodyLines::part_of(const std::vector<std::int32_t>& lines,
                                                 std::int32_t begin, std::int32_t end) {
  const auto first = std::ranges::lower_bound(lines, begin);
  return {first, std::lower_bound(first, lines.end(), end)};
}

void BodyLines::integrate_velocities(double h, double smooth_factor) {
  has_struck_ = any_of_moving([&](std::int32_t begin, std::int32_t end) {
    for (const std::int32_t line : part_of(tumbling_, begin, end)) {
      const Vector turned = free_turn(at(states_, line), at(turnings_, line), w(line), h);
      angular(at(loads_, line)) = (turned - w(line)) / h;
    }
    return kernels_->load(run(begin, end), h, smooth_factor * h);
  });
}

void BodyLines::strike(std::int32_t line, const Vector& dv, const Vector& dw, double t) {
  const State& state = at(states_, line);
  linear(at(frees_, line)) += dv;  // no contact that a sub-step would warm start
  angular(at(frees_, line)) += dw;
  BodyLine& motion = at(motions_, line);
  linear(motion) -= t * dv;
  angular(motion) -= t * dw;
  if (state.tumbles) turn(at(turnings_, line), dw, -t);
}

/// The attitude of a body with unequal moments.
void BodyLines::turn(Turning& turning, const Vector& w, double h) {
  if (turning.axial_share == 0) {
    turning.q = normalised(turning.q * rotation_exp(h * (turning.R_start.transpose() * w)));
    return;
  }
  const double unseen = (1 - turning.axial_share) * turning.axis.dot(w);
  turning.spin += h * unseen;
  turning.frame = normalised(turning.frame * rotation_exp(h * (w - unseen * turning.axis)));
}

void BodyLines::displace(std::int32_t line, const BodyLine& by) {
  twist(at(motions_, line)) += twist(by);
  const State& state = at(states_, line);
  if (state.tumbles) turn(at(turnings_, line), angular(by), 1);
}

void BodyLines::integrate_positions(double h, double smooth_factor) {
  for_moving([&](std::int32_t begin, std::int32_t end) {
    for (const std::int32_t line : part_of(tumbling_, begin, end)) {
      turn(at(turnings_, line), w(line), h);
    }
    kernels_->move(run(begin, end), h, smooth_factor * h);
  });
  for (std::int32_t line = moving_; line < moving_ + driven_; ++line) {
    twist(at(motions_, line)) += h * twist(at(velocities_, line));
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

/// Neighbours by slot share lines of the cache: a thread gets those.
void BodyLines::finish() {
  for_moving([&](std::int32_t begin, std::int32_t end) {
    for (std::int32_t k = begin; k < end; ++k) {
      const std::int32_t line = places_.empty() ? k : at(places_, k);
      const State& state = at(states_, line);
      const Turning& turning = at(turnings_, line);
      Rotation& q = bodies_.q[state.slot];
      twist(at(velocities_, line)) += TwistOfLine::Zero();  // no minus 0: see constraint_lanes.h
      move(state.slot, dp(line));
      bodies_.v[state.slot] = v(line);
      if (!state.turns) continue;
      if (state.tumbles && turning.axial_share != 0) {
        q = normalised(turning.frame * rotation_exp(turning.spin * turning.axis) * q);
        bodies_.w[state.slot] = turning.frame * Vector(w(line));
        continue;
      }
      q = state.tumbles ? turning.q : normalised(rotation_exp(theta(line)) * q);
      bodies_.w[state.slot] =
          state.tumbles ? Vector(q * (turning.R_start.transpose() * w(line))) : Vector(w(line));
    }
  });
}

}  // namespace cradle
