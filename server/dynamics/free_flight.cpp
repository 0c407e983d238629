// Sorts bodies by what their flight needs, and hands lists of equals to the wide kernels.
#include "server/dynamics/free_flight.h"

#include <cradle/limits.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "server/dynamics/flight_kernel.h"

namespace cradle {
namespace {

// At 0.16 energy drifts by 1.5e-8 in a minute ("240 random bodies"); T4 asks for 0.09 at most.
constexpr double kStepAngle_rad = 0.14;
// About 1.5 ms a body. At the fastest spin allowed, reached only at rates below 50 Hz.
constexpr double kStepsMax = 25'000;

std::vector<const FlightKernels*> usable_kernels() {
  std::vector<const FlightKernels*> all{&kFlightKernels1, &kFlightKernels2};
#ifdef CRADLE_WIDE_X86
  if (__builtin_cpu_supports("avx2")) all.push_back(&kFlightKernels4);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq")) {
    all.push_back(&kFlightKernels8);
  }
#endif
  return all;
}

const FlightKernels& kernels_of(int lanes) {
  static const std::vector<const FlightKernels*> usable = usable_kernels();
  if (lanes == 0) return *usable.back();
  for (const FlightKernels* kernels : usable) {
    if (kernels->lanes == lanes) return *kernels;
  }
  assert(false && "lanes are one of flight_lanes()");
  return *usable.front();
}

/// Bodies that need the same kernel; flown when there are enough, and at the end.
class Batch {
 public:
  Batch(FlightKernels::Kernel kernel, int lanes, bool falls)
      : kernel_(kernel), lanes_(static_cast<std::size_t>(lanes)), falls_(falls) {}

  void add(const FlightPointers& bodies, int slot) {
    slots_[count_] = slot;
    if (++count_ == kSize) fly(bodies);
  }
  void add(const FlightPointers& bodies, int slot, double steps) {
    steps_[count_] = steps;
    add(bodies, slot);
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
  std::array<double, kSize> steps_{};  // of bodies whose kernel asks for it
};

/// One batch a need, for bodies under gravity alone and for others.
struct Batches {
  Batches(const FlightKernels& k, bool falls)
      : straight(k.straight, k.lanes, falls),
        steady(k.steady, k.lanes, falls),
        tumbling(k.tumbling, k.lanes, falls),
        tumbling_fast(k.tumbling_fast, k.lanes, falls),
        twisted(k.twisted, k.lanes, falls) {}

  Batch straight, steady, tumbling, tumbling_fast, twisted;
};

double steps_for(double angle_rad) {
  return std::fmin(std::fmax(1.0, std::ceil(angle_rad / kStepAngle_rad)), kStepsMax);
}

class Sorter {
 public:
  Sorter(const FlightTick& tick, const FlightArrays& bodies, const FlightPointers& pointers,
         const FlightKernels& kernels)
      : bodies_(bodies),
        pointers_(pointers),
        dt_(tick.dt),
        falling_(kernels, true),
        others_(kernels, false) {}

  void add(int slot) {
    const auto i = static_cast<std::size_t>(slot);
    const Course course = bodies_.course[i];
    if (course == Course::still || course == Course::touches) return;
    Batches& batches = course == Course::falls ? falling_ : others_;
    const Vector& J = bodies_.inertia[i];
    const Vector& w = bodies_.w[i];
    const double speed2 = w.x() * w.x() + w.y() * w.y() + w.z() * w.z();  // in the kernels' order
    if (course == Course::pushed && !J.isZero(0)) {
      const double torque = bodies_.torque_W[i].norm() + bodies_.torque_P[i].norm();
      if (torque > 0) {
        // No more than the torque can do in the tick, whatever the attitude.
        const double speed =
            std::sqrt(speed2) + dt_ * torque * bodies_.inverse_inertia[i].maxCoeff();
        return batches.twisted.add(pointers_, slot, steps_for(dt_ * speed));
      }
    }
    if (speed2 == 0) return batches.straight.add(pointers_, slot);
    const bool is_round = J.x() == J.y() && J.y() == J.z();
    if (course == Course::driven || is_round) return batches.steady.add(pointers_, slot);
    if (speed2 * (dt_ * dt_) <= kStepAngle_rad * kStepAngle_rad) {
      return batches.tumbling.add(pointers_, slot);
    }
    batches.tumbling_fast.add(pointers_, slot, steps_for(dt_ * std::sqrt(speed2)));
  }

  void finish() {
    for (Batches* batches : {&falling_, &others_}) {
      for (Batch* batch : {&batches->straight, &batches->steady, &batches->tumbling,
                           &batches->tumbling_fast, &batches->twisted}) {
        batch->fly(pointers_);
      }
    }
  }

 private:
  const FlightArrays& bodies_;
  const FlightPointers& pointers_;
  double dt_;
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

void fly_all(const FlightTick& tick, const FlightArrays& bodies, int begin, int end) {
  const FlightPointers pointers = pointers_to(tick, bodies);
  const FlightKernels& kernels = kernels_of(tick.lanes);
  Sorter sorter(tick, bodies, pointers, kernels);
  for (int slot = begin; slot < end;) {
    const int next = std::min(slot + kernels.lanes, end);
    if (next - slot < kernels.lanes || !all_fall(bodies.course, slot, next) ||
        !kernels.tumble_row(pointers, slot, kStepAngle_rad)) {
      for (int i = slot; i < next; ++i) sorter.add(i);
    }
    slot = next;
  }
  sorter.finish();
}

std::vector<int> flight_lanes() {
  std::vector<int> lanes;
  for (const FlightKernels* kernels : usable_kernels()) lanes.push_back(kernels->lanes);
  return lanes;
}

}  // namespace cradle
