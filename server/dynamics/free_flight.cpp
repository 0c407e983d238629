// Sorts bodies by what their flight needs, and hands lists of equals to the wide kernels.
#include "server/dynamics/free_flight.h"

#include <cradle/limits.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "server/collision/machine_lanes.h"
#include "server/dynamics/flight_kernel.h"

namespace cradle {
namespace {

// About 1.5 ms a body. Reached only at rates below 50 Hz, at the fastest spin allowed; where it
// leaves steps of more than about 1.2 rad (spins of 3e4 rad/s at 1 Hz) most bodies are quarantined.
constexpr double kFlightStepsMax = 25'000;

const FlightKernels& flight_kernels_of(int lanes) {
#ifdef CRADLE_WIDE_X86
  return kernels_of_width<FlightKernels>(
      lanes, {&kFlightKernels1, &kFlightKernels2, &kFlightKernels4, &kFlightKernels8});
#else
  return kernels_of_width<FlightKernels>(lanes, {&kFlightKernels1, &kFlightKernels2});
#endif
}

double steps_for(double angle_rad) {
  return std::fmin(std::fmax(1.0, std::ceil(angle_rad / kStepAngle_rad)), kFlightStepsMax);
}

bool turns_freely(Course course, const Vector& J) {
  return course != Course::driven && !J.isZero(0);
}

/// Of a body in a planar world.
Turn turn_in_plane(const FlightArrays& bodies, std::size_t i) {
  const bool is_pushed = bodies.course[i] == Course::pushed && bodies.inverse_inertia[i].z() != 0;
  const bool is_twisted = is_pushed && (bodies.torque_W[i].z() != 0 || bodies.torque_P[i].z() != 0);
  return is_twisted || bodies.w[i].z() != 0 ? Turn::planar : Turn::none;
}

constexpr std::size_t kTurns = 7;

FlightKernels::Kernel kernel_of(const FlightKernels& kernels, Turn turn) {
  const std::array<FlightKernels::Kernel, kTurns> all{
      kernels.straight, kernels.steady,        kernels.tumbling, kernels.tumbling_fast,
      kernels.twisted,  kernels.twisted_round, kernels.planar};
  return all[static_cast<std::size_t>(turn)];
}

/// Bodies that need the same kernel; flown when there are enough, and at the end.
class Batch {
 public:
  Batch(FlightKernels::Kernel kernel, int lanes, bool falls)
      : kernel_(kernel), lanes_(static_cast<std::size_t>(lanes)), falls_(falls) {}

  void add(const FlightPointers& bodies, int slot, double steps) {
    slots_[count_] = slot;
    steps_[count_] = steps;
    if (++count_ == kSize) fly(bodies);
  }

  void fly(const FlightPointers& bodies) {
    while (count_ % lanes_ != 0) {
      slots_[count_] = slots_[count_ - 1];
      steps_[count_] = steps_[count_ - 1];
      ++count_;
    }
    kernel_(bodies, {slots_.data(), steps_.data(), static_cast<int>(count_), falls_});
    count_ = 0;
  }

 private:
  static constexpr std::size_t kSize = 32;  // bodies, which are still in the cache
  static_assert(kSize % kFlightLanesMax == 0);

  FlightKernels::Kernel kernel_;
  std::size_t lanes_;
  bool falls_;
  std::size_t count_ = 0;
  std::array<std::int32_t, kSize> slots_;
  std::array<double, kSize> steps_;
};

/// One batch a turn.
using Batches = std::array<Batch, kTurns>;
Batches batches(const FlightKernels& kernels, bool falls) {
  const auto one = [&](Turn turn) { return Batch(kernel_of(kernels, turn), kernels.lanes, falls); };
  return {one(Turn::none),          one(Turn::steady),  one(Turn::tumbling),
          one(Turn::tumbling_fast), one(Turn::twisted), one(Turn::twisted_round),
          one(Turn::planar)};
}

/// Bodies under gravity alone, and others.
class Sorter {
 public:
  Sorter(const FlightTick& tick, const FlightArrays& bodies, const FlightPointers& pointers,
         const FlightKernels& kernels)
      : tick_(tick),
        bodies_(bodies),
        pointers_(pointers),
        falling_(batches(kernels, true)),
        others_(batches(kernels, false)) {}

  void add(int slot) {
    const auto i = static_cast<std::size_t>(slot);
    const Course course = bodies_.course[i];
    if (course == Course::still || course >= Course::touches) return;
    const FlightNeed need = flight_need(tick_, bodies_, i);
    Batches& batches = course == Course::falls ? falling_ : others_;
    batches[static_cast<std::size_t>(need.turn)].add(pointers_, slot, need.steps);
  }

  void finish() {
    for (Batch& batch : falling_) batch.fly(pointers_);
    for (Batch& batch : others_) batch.fly(pointers_);
  }

 private:
  const FlightTick& tick_;
  const FlightArrays& bodies_;
  const FlightPointers& pointers_;
  Batches falling_, others_;
};

/// Vectors as their doubles.
template <class T>
auto* doubles(std::span<T> values) {
  using Doubles = std::conditional_t<std::is_const_v<T>, const double, double>;
  return reinterpret_cast<Doubles*>(values.data());
}
static_assert(sizeof(Vector) == 3 * sizeof(double) && sizeof(Rotation) == 4 * sizeof(double));

FlightPointers pointers_to(const FlightTick& tick, const FlightArrays& bodies) {
  return {doubles(bodies.x),
          doubles(bodies.q),
          doubles(bodies.v),
          doubles(bodies.w),
          doubles(bodies.inertia),
          doubles(bodies.inverse_inertia),
          doubles(bodies.acceleration),
          doubles(bodies.torque_W),
          doubles(bodies.torque_P),
          bodies.lost.data(),
          tick.dt,
          {tick.gravity_W.x(), tick.gravity_W.y(), tick.gravity_W.z()},
          limits::kPositionMax_m,
          limits::kSpeedMax_mps,
          limits::kAngularSpeedMax_radps};
}

bool all_fall(std::span<const Course> course, int begin, int end) {
  bool all = true;
  for (int i = begin; i < end; ++i) all &= course[static_cast<std::size_t>(i)] == Course::falls;
  return all;
}

}  // namespace

FlightNeed flight_need(const FlightTick& tick, const FlightArrays& bodies, std::size_t i) {
  // A half-space in a planar world has z_B in the plane: it is driven as in space.
  const bool lies_in_plane = tick.is_planar && bodies.q[i].x() == 0 && bodies.q[i].y() == 0;
  if (lies_in_plane && tick.full_steps == 0) return {turn_in_plane(bodies, i), 0};
  const Course course = bodies.course[i];
  const Vector& J = bodies.inertia[i];
  const Vector& w = bodies.w[i];
  const double speed2 = w.x() * w.x() + w.y() * w.y() + w.z() * w.z();  // in the kernels' order
  if (speed2 == 0 && course == Course::falls) return {Turn::none, 0};
  const bool is_round = J.x() == J.y() && J.y() == J.z();
  const double torque = course == Course::pushed && turns_freely(course, J)
                            ? bodies.torque_W[i].norm() + bodies.torque_P[i].norm()
                            : 0;
  if (torque > 0 || (tick.full_steps > 0 && turns_freely(course, J))) {
    // No more than the torque can do in the tick, whatever the attitude.
    const double speed =
        std::sqrt(speed2) + tick.dt * torque * bodies.inverse_inertia[i].maxCoeff();
    const bool leaves_gyroscopic_out = is_round && tick.full_steps == 0;
    return {leaves_gyroscopic_out ? Turn::twisted_round : Turn::twisted,
            std::fmax(tick.full_steps, steps_for(tick.dt * speed))};
  }
  if (speed2 == 0) return {Turn::none, 0};
  if (course == Course::driven || is_round) return {Turn::steady, 0};
  if (speed2 * (tick.dt * tick.dt) <= kStepAngle_rad * kStepAngle_rad) return {Turn::tumbling, 1};
  return {Turn::tumbling_fast, steps_for(tick.dt * std::sqrt(speed2))};
}

void fly_all(const FlightTick& tick, const FlightArrays& bodies, int begin, int end) {
  const FlightPointers pointers = pointers_to(tick, bodies);
  const FlightKernels& kernels = flight_kernels_of(tick.lanes);
  Sorter sorter(tick, bodies, pointers, kernels);
  for (int slot = begin; slot < end;) {
    const int next = std::min(slot + kernels.lanes, end);
    const bool is_row = next - slot == kernels.lanes && all_fall(bodies.course, slot, next);
    const bool has_flown =
        is_row && (tick.is_planar ? kernels.planar_row(pointers, slot)
                                  : kernels.free_row(pointers, slot, kStepAngle_rad));
    if (!has_flown) {
      for (int i = slot; i < next; ++i) sorter.add(i);
    }
    slot = next;
  }
  sorter.finish();
}

int fly(Flight& body, double dt, const Vector& acceleration, const Vector& torque_W,
        const Vector& torque_P, const Vector& inertia) {
  const Course course = Course::pushed;
  const Vector inverse =
      inertia.isZero(0) ? Vector(Vector::Zero()) : Vector(inertia.cwiseInverse());
  std::uint8_t lost = 0;
  const auto one = [](auto& value) { return std::span(&value, 1); };
  const FlightArrays alone{one(course),   one(body.x),   one(body.q),  one(body.v),
                           one(body.w),   one(inertia),  one(inverse), one(acceleration),
                           one(torque_W), one(torque_P), one(lost)};
  const FlightTick tick{dt, Vector::Zero(), 1, 0, false};
  const FlightNeed need = flight_need(tick, alone, 0);
  const std::int32_t slot = 0;
  kernel_of(kFlightKernels1, need.turn)(pointers_to(tick, alone), {&slot, &need.steps, 1, false});
  return static_cast<int>(need.steps);
}

}  // namespace cradle
