// A bound on the difference between free flight with what a body needs and the full model, which
// has every term and takes several times as many steps.
//
// Symbols: e = (phi, h w), the error of attitude (a rotation vector, rad) and of angular velocity,
// in P; h the tick; Phi = d e(end) / d e(start) of the tick, by central differences of the flight
// itself.
//
// What a tick's series leaves out is found by going through it in twice as many steps. Phi carries
// it along: what a body's instability makes of an early error counts, to first order.
//
// The doubt about that, 5 % of it for higher orders, is carried along as an ellipsoid; a sum is the
// outer one of least trace (Durieu, Walter, Polyak 2001, J. Optim. Theory Appl. 111).
//
// Rounding has two parts. What differs from step to step is carried along as a variance; six
// standard deviations of it are in the bound. What is the same in step after step (small turns of
// a slow body are rounded alike) is part of the doubt, and grows with the number of steps.
//
// A force at a point of the body has a torque that depends on the attitude: that is part of Phi.
// What forces that turn with the body do to its place is bounded by their size times the error of
// the attitude; from then on the two places differ, and so does their rounding, at the size of the
// distance from the origin.
//
// Beyond 0.1 rad the second order is larger than the doubt: from there on nothing is known.
//
// Cost: 2 us a body and tick, most of it 12 flights for Phi.
#include "server/dynamics/flight_error.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "server/dynamics/rotation.h"

namespace cradle {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double kDigit = std::numeric_limits<double>::epsilon();
constexpr double kRoundingOfStep = 2.0;       // standard deviation of a step's rounding, in kDigit
constexpr double kDeviations = 6;             // of rounding, that the bound holds
constexpr double kBiasOfStep = 1.0;           // of a step's attitude, alike in all steps, in kDigit
constexpr double kBiasOfSpin = 0.5;           // likewise of its angular velocity, relative
constexpr double kRoundingOfForce = 4;        // turned into W and divided by the mass, in kDigit
constexpr double kUnturned_rad = 4 * kDigit;  // q made unit
constexpr double kSixthOrder = 64.0 / 63;     // the error, by what half the steps change
constexpr double kDoubt = 0.05;               // of that, for higher orders
constexpr double kDifference = 1e-5;          // rad, of the central differences
constexpr double kFirstOrder_rad = 2 * kDoubt;  // where the second order, e^2 / 2, is kDoubt e
constexpr double kStep_rad = 0.1;  // less than what a step of the series turns at most, 0.14

/// The state relative to `at`, in its P.
Vector6 difference(const Flight& at, const Flight& other, double dt) {
  const Rotation turn = at.q.conjugate() * other.q;
  Vector6 e;
  e.head<3>() = (turn.w() < 0 ? -2.0 : 2.0) * turn.vec();
  e.tail<3>() = dt * (other.q.conjugate() * other.w - at.q.conjugate() * at.w);
  return e;
}

/// The angular part of a wrench, in W, on the body turned by `turn` (W) from where it is.
Vector angular(const Resultant& load, const Rotation& turn) {
  if (load.arm_W.isZero(0)) return load.angular;
  const Vector arm = load.arm_turns ? turn * load.arm_W : load.arm_W;
  return arm.cross(load.linear_turns ? turn * load.linear : load.linear);
}

/// Sum over what is constant neither in W nor in P, and in W over what is constant there.
Vector angular(const FlightSample& f, const Rotation& turn, bool of_impulses) {
  Vector sum = Vector::Zero();
  for (const Resultant& load : f.resultants) {
    if (load.is_impulse == of_impulses && !load.angular_in_P) sum += angular(load, turn);
  }
  return sum;
}

Flight flown(const FlightSample& f, const Vector6& offset) {
  Flight body = f.start;
  const Vector w_P = f.start.q.conjugate() * f.start.w + offset.tail<3>() / f.dt;
  body.q = f.start.q * rotation_exp(offset.head<3>());
  body.w = body.q * w_P;
  const Rotation turn = body.q * f.start.q.conjugate();
  const Vector torque_W =
      f.torque_W + angular(f, turn, false) - angular(f, Rotation::Identity(), false);
  fly(body, f.dt, Vector::Zero(), torque_W, f.torque_P, f.inertia);
  return body;
}

/// What the tick's series leaves out, by twice as many steps.
Vector6 truncation(const FlightSample& f, const Flight& end) {
  if (f.need.steps == 0) return Vector6::Zero();
  Flight fine = f.start;
  const double steps = 2 * f.need.steps;
  for (double k = 0; k < steps; ++k) {
    fly(fine, f.dt / steps, Vector::Zero(), f.torque_W, f.torque_P, f.inertia);
  }
  return kSixthOrder * difference(fine, end, f.dt);
}

/// How the impulses at the tick's start carry the error on: an error of the attitude changes what
/// they do to the angular velocity in P.
Matrix6 tangent_of_impulses(const FlightSample& f) {
  Matrix6 phi = Matrix6::Identity();
  if (f.inertia.isZero(0)) return phi;
  const auto kick_P = [&](const Vector& offset) {
    const Rotation q = f.start.q * rotation_exp(offset);
    return Vector(q.conjugate() * angular(f, q * f.start.q.conjugate(), true));
  };
  for (int k = 0; k < 3; ++k) {
    const Vector offset = kDifference * Vector::Unit(k);
    phi.col(k).tail<3>() =
        f.dt / (2 * kDifference) * (kick_P(offset) - kick_P(-offset)).cwiseQuotient(f.inertia);
  }
  return phi;
}

Matrix6 tangent(const FlightSample& f, const Flight& end) {
  Matrix6 phi;
  for (int k = 0; k < 6; ++k) {
    const Vector6 offset = kDifference * Vector6::Unit(k);
    phi.col(k) =
        (difference(end, flown(f, offset), f.dt) - difference(end, flown(f, -offset), f.dt)) /
        (2 * kDifference);
  }
  return phi;
}

/// Most that the torques add to h w in the tick.
double twist(const FlightSample& f) {
  if (f.inertia.isZero(0)) return 0;
  return f.dt * f.dt * (f.torque_W.norm() + f.torque_P.norm()) / f.inertia.minCoeff();
}

Matrix6 balls(double phi, double hw) {
  Vector6 squares;
  squares << Vector::Constant(phi * phi), Vector::Constant(hw * hw);
  return squares.asDiagonal();
}

/// Of the part that is attitude.
double longest_axis(const Matrix6& ellipsoid) {
  const Matrix attitude = ellipsoid.topLeftCorner<3, 3>();
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(attitude, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues().maxCoeff()));
}

}  // namespace

double FlightError::angle_rad() const { return is_known_ ? grown_rad() : std::numbers::pi; }

double FlightError::distance_m() const {
  if (!is_known_) return std::numeric_limits<double>::infinity();
  return distance_m_ + digit_m_ + kDeviations * std::sqrt(place_variance_);
}

double FlightError::grown_rad() const {
  return unturned_rad_ + drift_.head<3>().norm() + longest_axis(doubt_) +
         kDeviations * longest_axis(noise_);
}

void FlightError::fly(const FlightSample& f) {
  if (!is_known_) return;
  // A point turns at constant velocity in the full model as well.
  if (f.inertia.isZero(0) && f.need.turn != Turn::planar) return;
  add_displacement(f);
  if (f.need.turn == Turn::none) {
    unturned_rad_ = std::max(unturned_rad_, kUnturned_rad);
  } else {
    turn(f);
  }
  // Said so that what is not a number is not known, either.
  is_known_ = doubt_.allFinite() && noise_.allFinite() && std::isfinite(distance_m()) &&
              grown_rad() <= kFirstOrder_rad;
}

void FlightError::turn(const FlightSample& f) {
  const Flight end = flown(f, Vector6::Zero());
  const Matrix6 phi = tangent(f, end) * tangent_of_impulses(f);
  const Vector6 left_out = truncation(f, end);
  drift_ = phi * drift_ + left_out;
  doubt_ = phi * doubt_ * phi.transpose();

  const double hw = f.dt * std::max(f.start.w.norm(), end.w.norm()) + twist(f);
  const double lean_steps = std::max(1.0, f.need.steps);
  const double full_steps = std::max(f.full_steps, std::ceil(hw / kStep_rad));
  const double steps = lean_steps + full_steps;
  // Without a torque, a body with equal moments or about an axis of its own keeps its h w in every
  // step, and each model turns it from W and back once a tick.
  const bool keeps_spin =
      f.need.turn == Turn::steady || (f.need.turn == Turn::planar && twist(f) == 0);
  const double spins = keeps_spin ? 2 : steps;
  add_doubt(kDoubt * left_out.head<3>().norm() + kBiasOfStep * kDigit * steps,
            kDoubt * left_out.tail<3>().norm() + kBiasOfSpin * kDigit * spins * hw +
                f.dt * error_of_arms(f));
  const double rounding = kRoundingOfStep * kDigit * std::sqrt(steps);
  noise_ = phi * noise_ * phi.transpose() + balls(rounding, rounding * hw);
}

/// rad/s: forces at points of the world have arms that are wrong by the error of the place.
double FlightError::error_of_arms(const FlightSample& f) const {
  if (f.inertia.isZero(0)) return 0;
  double change = 0;
  for (const Resultant& load : f.resultants) {
    if (load.arm_W.isZero(0) || load.arm_turns) continue;
    change += (load.is_impulse ? 1 : f.dt) * distance_m() * load.linear.norm();
  }
  return change / f.inertia.minCoeff();
}

/// What turns with the body pushes it in a direction that is wrong by the attitude's error.
void FlightError::add_displacement(const FlightSample& f) {
  const double angle = angle_rad();
  double impulse = 0, force = 0;
  for (const Resultant& load : f.resultants) {
    if (load.linear_turns) (load.is_impulse ? impulse : force) += load.linear.norm();
  }
  speed_mps_ += impulse / f.mass * angle;
  distance_m_ += f.dt * speed_mps_ + f.dt * f.dt / 2 * force / f.mass * angle;
  speed_mps_ += f.dt * force / f.mass * angle;
  was_pushed_along_ = was_pushed_along_ || impulse > 0 || force > 0;
  if (was_pushed_along_) add_rounding_of_place(f, impulse + f.dt * force);
}

/// Two sums that differ by less than a last digit are mostly rounded alike: the part of that digit
/// is how often they are not. One digit is there from the first time on.
void FlightError::add_rounding_of_place(const FlightSample& f, double push_Ns) {
  const double change = push_Ns / f.mass;
  const double digit_mps = kDigit * (f.start.v.norm() + change);
  const double digit_m = kDigit * (f.start.x.norm() + f.dt * f.start.v.norm());
  const double apart_mps = (grown_rad() + kRoundingOfForce * kDigit) * change;
  speed_variance_ += digit_mps * std::min(digit_mps, apart_mps);
  const double speed_mps = speed_mps_ + digit_mps + kDeviations * std::sqrt(speed_variance_);
  distance_m_ += f.dt * (speed_mps - speed_mps_);
  place_variance_ += digit_m * std::min(digit_m, f.dt * speed_mps);
  digit_m_ = std::max(digit_m_, digit_m);
}

/// The sum with an ellipsoid around the two balls.
void FlightError::add_doubt(double phi, double hw) {
  const Matrix6 added = 2 * balls(phi, hw);
  const double from = std::sqrt(doubt_.trace()), by = std::sqrt(added.trace());
  if (by == 0) return;
  doubt_ = from == 0 ? added : Matrix6((1 + by / from) * doubt_ + (1 + from / by) * added);
}

}  // namespace cradle
