/// What the wide kernels of free flight and their caller (free_flight.cpp) agree on. Plain numbers:
/// the kernels' files are compiled for one instruction set each and must share no inline code with
/// others.
#pragma once

#include <cstdint>

namespace cradle {

/// The bodies, by slot: three doubles a vector, four (x y z w) a quaternion. As FlightArrays.
struct FlightPointers {
  double* x;
  double* q;
  double* v;
  double* w;
  const double* inertia;
  const double* inverse_inertia;
  const double* acceleration;
  const double* torque_W;
  const double* torque_P;
  std::uint8_t* lost;
  double dt;
  double gravity_W[3];
  double position_max, speed_max, angular_speed_max;
};

/// Bodies that need the same, in ascending slots. `count` is a multiple of the kernel's lanes: the
/// last slot may be repeated to fill its block, whose lanes then do the same.
struct FlightList {
  const std::int32_t* slots;
  const double* steps;  ///< equal steps of the tick, one number a slot, whole and >= 1
  int count;
  bool falls;  ///< acceleration: gravity; else the body's own
};
inline constexpr int kFlightLanesMax = 8;

/// Each moves a list of bodies through a tick. They differ in what turns.
struct FlightKernels {
  using Kernel = void (*)(const FlightPointers&, const FlightList&);
  int lanes;  ///< bodies side by side
  /// `lanes` bodies in a row that fall, if none of them turns, or all tumble by at most
  /// `step_angle` (rad) in the tick; else nothing, and false.
  bool (*free_row)(const FlightPointers&, std::int32_t first, double step_angle);
  /// Likewise in a planar world, if all of them turn and lie in the plane.
  bool (*planar_row)(const FlightPointers&, std::int32_t first);
  Kernel straight;       ///< nothing
  Kernel steady;         ///< at constant angular velocity
  Kernel tumbling;       ///< freely, in one step: `steps` is not read
  Kernel tumbling_fast;  ///< freely
  Kernel twisted;        ///< under torques
  Kernel twisted_round;  ///< under torques, with equal moments
  Kernel planar;         ///< about z alone, in the plane z = 0: `steps` is not read
};

extern const FlightKernels kFlightKernels1, kFlightKernels2;
#ifdef CRADLE_WIDE_X86
extern const FlightKernels kFlightKernels4;  ///< needs AVX2
extern const FlightKernels kFlightKernels8;  ///< needs AVX-512 F, VL, DQ
#endif

}  // namespace cradle
