// What became of the energy and momentum of the bodies in contact: contact_balance.h.
#include <algorithm>

#include "server/dynamics/contact/body_lines.h"

namespace cradle {

void BodyLines::take_means(double h) {
  if (means_.size() < lines_) means_.resize(velocities_.size());
  for_moving([&](std::int32_t begin, std::int32_t end) {
    kernels_->average(run(begin, end), means_.data());
    for (const std::int32_t line : part_of(tumbling_, begin, end)) {
      // The gyroscopic term does no work: what contacts did begins after it.
      angular(at(means_, line)) = 0.5 * (angular(at(frees_, line)) + w(line));
    }
  });
  std::copy(velocities_.begin() + moving_,
            velocities_.begin() + static_cast<std::ptrdiff_t>(lines_), means_.begin() + moving_);
  for (const std::int32_t line : twisted_) {
    const State& state = at(states_, line);
    const Vector w_free = angular(at(frees_, line));
    const Vector w_mean =
        0.5 * (angular(at(begins_, line)) + (state.tumbles ? w_free : Vector(w(line))));
    const Turning& turning = at(turnings_, line);
    const bool goes_with_axis = state.tumbles && turning.axial_share != 0;
    const Vector w_W = goes_with_axis ? Vector(turning.frame * w_mean)
                       : state.tumbles
                           ? Vector(turning.q * Vector(turning.R_start.transpose() * w_mean))
                           : w_mean;
    work_of_torques_ += h * bodies_.torque[state.slot].dot(w_W);
  }
}

double BodyLines::kinetic_energy(std::int32_t line, const Vector& v, const Vector& w) const {
  const State& state = at(states_, line);
  const double linear = mass(line) * v.squaredNorm();
  if (!state.turns) return 0.5 * linear;
  const Vector& J = bodies_.inertia[state.slot];
  if (!state.tumbles) return 0.5 * (linear + J.x() * w.squaredNorm());
  // Round bodies' lines turn with them about the axis alone, which leaves J as it is.
  const Vector w_P = at(turnings_, line).R_start.transpose() * w;
  return 0.5 * (linear + J.dot(w_P.cwiseAbs2()));
}

void BodyLines::begin_balance(ContactBalance& balance) {
  work_of_torques_ = 0;
  add_by_parts(balance, [this](std::int32_t line, ContactBalance& part) {
    part.kinetic_J -= kinetic_energy(line, v(line), w(line));
    part.momentum -= mass(line) * v(line);
  });
}

void BodyLines::end_balance(ContactBalance& balance, double dt) {
  add_by_parts(balance, [&](std::int32_t line, ContactBalance& part) {
    const double mass = this->mass(line);
    const Vector way = mass * dp(line);
    const Vector acceleration = this->acceleration(line);
    part.kinetic_J += kinetic_energy(line, v(line), w(line));
    part.momentum += mass * v(line);
    part.mass_way += way;
    part.loads_J += acceleration.dot(way);
    part.loads_Ns += dt * mass * acceleration;
  });
  balance.loads_J += work_of_torques_;
}

}  // namespace cradle
