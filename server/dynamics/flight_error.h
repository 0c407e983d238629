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

/// Grows with every tick that the body flies. flight_error.cpp states what it counts.
class FlightError {
 public:
  void fly(const FlightSample& sample);

  double angle_rad() const;                          ///< of the attitude
  double distance_m() const { return distance_m_; }  ///< of Bcm

 private:
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  double error_of_arms(const FlightSample& sample) const;
  void add_doubt(double phi, double hw);
  void add_displacement(const FlightSample& sample);

  Eigen::Matrix<double, 6, 1> drift_ = Eigen::Matrix<double, 6, 1>::Zero();
  Matrix6 doubt_ = Matrix6::Zero();  // drift_ is wrong by what is inside x^T doubt^-1 x = 1
  Matrix6 noise_ = Matrix6::Zero();  // variance of rounding
  double unturned_rad_ = 0;
  double distance_m_ = 0, speed_mps_ = 0;
};

}  // namespace cradle
