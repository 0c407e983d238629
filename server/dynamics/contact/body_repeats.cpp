// A warm start gives contacts what they gave in the sub-step before. What a contact at rest bears
// comes again; a blow does not. One that is given once more sets in motion what it has stopped, and
// one sweep does not take that back: 40 bricks that fell upon each other gained 29 J in a tick.
//
// So the kinetic energy that the warm start gives by contacts of bodies that were struck,
//   W = sum dp . (v - dv / 2)  of all bodies, dv the change by these contacts, dp = M dv, v after
//   it
// must not be above 0 in an island. Contacts at rest, which stop what loads make, take energy. If W
// is above 0, the impulses of these contacts are scaled to where the energy is least along them.
//
// Where all contacts of an island together give no energy, W is not looked into, and may be above
// 0: what they all give to each body is known, and costs no pass over them.
#include <algorithm>
#include <utility>

#include "server/dynamics/contact/body_lines.h"

namespace cradle {

void BodyLines::find_struck(double h, double smooth_factor) {
  has_struck_ = any_of_moving([&](std::int32_t begin, std::int32_t end) {
    return kernels_->look(run(begin, end), smooth_factor * h);
  });
}

/// J, by what made its velocities from these.
double BodyLines::energy_given(std::int32_t line, const Vector& v_before,
                               const Vector& w_before) const {
  if (at(states_, line).tumbles) {
    return kinetic_energy(line, v(line), w(line)) - kinetic_energy(line, v_before, w_before);
  }
  const double of_v = (v(line) - v_before).dot(v(line) + v_before);
  const double of_w = (w(line) - w_before).dot(w(line) + w_before);
  return 0.5 * mass(line) * (of_v + at(gyration2_, line) * of_w);
}

void BodyLines::forgive_struck() {
  for_moving([&](std::int32_t begin, std::int32_t end) {
    for (const std::int32_t line : part_of(tumbling_, begin, end)) {
      const BodyLine& free = at(frees_, line);
      at(gains_, line) = energy_given(line, linear(free), angular(free));
    }
  });
  add_up(gains_, gains_of_islands_);
  bool is_any_struck = false;
  for (std::int32_t line = 0; line < moving_; ++line) {
    double& is_struck = at(struck_, line);
    if (gains_of_islands_[island_of(line)] <= 0) is_struck = 0;
    is_any_struck |= is_struck != 0;
  }
  has_struck_ = is_any_struck;
}

void BodyLines::add_up(const std::vector<double>& gains, std::vector<double>& of_islands) const {
  of_islands.assign(islands_count_, 0);
  if (moving_ == 0) return;
  std::size_t island = island_of(0);
  double sum = 0;  // its sum, so far: neighbours are mostly of one island
  for (std::int32_t line = 0; line < moving_; ++line) {
    if (const std::size_t here = island_of(line); here != island) {
      of_islands[island] = sum;
      sum = of_islands[island = here];
    }
    sum += at(gains, line);
  }
  of_islands[island] = sum;
}

void BodyLines::begin_repeats() {
  if (repeats_.size() < velocities_.size()) repeats_.resize(velocities_.size());
  for_moving([&](std::int32_t begin, std::int32_t end) {
    for (std::int32_t line = begin; line < end; ++line) {
      at(repeats_, line) = at(velocities_, line);
      twist(at(repeats_, line)) = 0;
    }
  });
  std::swap(velocities_, repeats_);
}

std::span<const double> BodyLines::limit_repeats() {
  own_gains_.resize(moving());
  for_moving([&](std::int32_t begin, std::int32_t end) {
    for (std::int32_t line = begin; line < end; ++line) {
      const Vector dv = linear(at(repeats_, line)), dw = angular(at(repeats_, line));
      at(gains_, line) = at(own_gains_, line) = 0;
      if (dv.isZero(0) && dw.isZero(0)) continue;
      at(gains_, line) = energy_given(line, v(line) - dv, w(line) - dw);
      at(own_gains_, line) = kinetic_energy(line, dv, dw);
    }
  });
  add_up(gains_, gains_of_islands_);
  add_up(own_gains_, own_gains_of_islands_);
  shares_.assign(islands_count_, 1);
  bool is_any_less = false;
  for (std::size_t i = 0; i < islands_count_; ++i) {
    const double gain = gains_of_islands_[i], own = own_gains_of_islands_[i];
    if (gain <= 0) continue;
    is_any_less = true;
    // Of a share x: x (gain - own) + x^2 own, least at (1 - gain / own) / 2.
    shares_[i] = std::max(0.0, 0.5 * (1 - gain / own));
  }
  if (!is_any_less) return {};
  for_moving([&](std::int32_t begin, std::int32_t end) {
    for (std::int32_t line = begin; line < end; ++line) {
      const double less = shares_[island_of(line)] - 1;
      if (less != 0) twist(at(velocities_, line)) += less * twist(at(repeats_, line));
    }
  });
  return shares_;
}

}  // namespace cradle
