#include "server/dynamics/contact/contact_balance.h"

#include <algorithm>
#include <cmath>

#include "server/dynamics/contact/friction_cone.h"

namespace cradle {
namespace {

/// Of the tangential part. Nothing here is so large or small as to need std::hypot, which takes as
/// long as all else.
double along_t(const Vector& z) { return std::sqrt(z.y() * z.y() + z.z() * z.z()); }

template <class Row>
double sum_in(const Row& row) {
  double total = 0;
  for (const auto value : row) total += value;
  return total;
}
template <class Row>
double largest_in(const Row& row) {
  return std::ranges::max(row);
}

void raise(PointResidual& most, const PointResidual& one) {
  most.natural_mps = std::max(most.natural_mps, one.natural_mps);
  most.signorini_mps = std::max(most.signorini_mps, one.signorini_mps);
  most.cone_mps = std::max(most.cone_mps, one.cone_mps);
  most.complementarity_J = std::max(most.complementarity_J, one.complementarity_J);
}

}  // namespace

PointResidual residual_of(double K, double friction, const Vector& impulse,
                          const Vector& velocity) {
  const Vector p = K * impulse;
  const double slide = friction * along_t(velocity);
  const Vector u = velocity + Vector(slide, 0, 0);
  return {(p - on_cone(p - u, friction).g).norm(), std::abs(std::min(p.x(), velocity.x())),
          std::max(along_t(p) - friction * p.x(), 0.0), std::abs(impulse.dot(u))};
}

void ContactResidual::add(double K, double friction, const Vector& impulse,
                          const Vector& velocity) {
  const PointResidual one = residual_of(K, friction, impulse, velocity);
  raise(most, one);
  natural2 += one.natural_mps * one.natural_mps;
  impulse2 += K * K * impulse.squaredNorm();
  velocity2 += velocity.squaredNorm();
}

template <class Real>
void ContactResidual::add(const ContactTally<Real>& tally) {
  raise(most, {std::sqrt(largest_in(tally.natural2)), largest_in(tally.signorini),
               largest_in(tally.cone), largest_in(tally.complementarity)});
  natural2 += sum_in(tally.natural2_sum);
  impulse2 += sum_in(tally.impulse2_sum);
  velocity2 += sum_in(tally.velocity2_sum);
}

void ContactResidual::add(const ContactResidual& other) {
  raise(most, other.most);
  natural2 += other.natural2;
  impulse2 += other.impulse2;
  velocity2 += other.velocity2;
}

double ContactResidual::relative() const {
  const double scale2 = std::max(impulse2, velocity2);
  return scale2 > 0 ? std::sqrt(natural2 / scale2) : 0;
}

void ContactBalance::add(const ContactBalance& other) {
  kinetic_J += other.kinetic_J;
  loads_J += other.loads_J;
  friction_J += other.friction_J;
  impacts_J += other.impacts_J;
  driven_J += other.driven_J;
  mass_way += other.mass_way;
  momentum += other.momentum;
  loads_Ns += other.loads_Ns;
  contacts_Ns += other.contacts_Ns;
}

template <class Real>
void ContactBalance::add(const ContactWork<Real>& work) {
  friction_J += sum_in(work.friction);
  impacts_J += sum_in(work.normal);
  driven_J += sum_in(work.driven);
  contacts_Ns +=
      Vector(sum_in(work.momentum[0]), sum_in(work.momentum[1]), sum_in(work.momentum[2]));
}

template void ContactResidual::add(const ContactTally<double>&);
template void ContactResidual::add(const ContactTally<float>&);
template void ContactBalance::add(const ContactWork<double>&);
template void ContactBalance::add(const ContactWork<float>&);

}  // namespace cradle
