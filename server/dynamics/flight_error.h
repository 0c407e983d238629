/// How far a body in free flight may be from the full model of itself, for `cradled explain`.
#pragma once

#include <span>

#include "server/dynamics/loads.h"

namespace cradle {

/// A body at the beginning of a tick of free flight, after its impulses.
struct FlightSample {
  double dt = 0;  ///< s
  FlightNeed need;
  Flight start;
  Vector inertia = Vector::Zero();   ///< principal moments, kg m^2
  Vector torque_W = Vector::Zero();  ///< N m, as FlightArrays
  Vector torque_P = Vector::Zero();
  double mass = 0;                        ///< kg
  std::span<const Resultant> resultants;  ///< of the wrenches that act, impulses included
  double full_steps = 1;                  ///< a tick, of the full model
};

/// Grows with every tick that the body flies. flight_error.cpp states what it counts. Once it has
/// grown beyond what that holds for, nothing is known of it any more.
class FlightError {
 public:
  void fly(const FlightSample& sample);

  bool is_known() const { return is_known_; }
  double angle_rad() const;   ///< of the attitude; pi if not known
  double distance_m() const;  ///< of Bcm; infinite if not known

 private:
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  void turn(const FlightSample& sample);
  double grown_rad() const;
  double error_of_arms(const FlightSample& sample) const;
  void add_doubt(double phi, double hw);
  void add_displacement(const FlightSample& sample);
  void add_rounding_of_place(const FlightSample& sample, double push_Ns);

  Eigen::Matrix<double, 6, 1> drift_ = Eigen::Matrix<double, 6, 1>::Zero();
  Matrix6 doubt_ = Matrix6::Zero();  // drift_ is wrong by what is inside x^T doubt^-1 x = 1
  Matrix6 noise_ = Matrix6::Zero();  // variance of rounding
  double unturned_rad_ = 0;
  double distance_m_ = 0, speed_mps_ = 0;
  double speed_variance_ = 0, place_variance_ = 0, digit_m_ = 0;  // of rounding
  bool is_known_ = true, was_pushed_along_ = false;  // by a force that turns with the body
};

}  // namespace cradle
