// Bodies in contact side by side, for the kernels' files alone (see lanes.h). What they do, and
// symbols: body_lines.h.
#pragma once

#include "server/dynamics/contact/manifold_lanes.h"

namespace cradle {
namespace {

template <class V>
struct LineRows {
  V r[kLineNumbers];
  CRADLE_LANES Triple<V> linear() const { return {r[0], r[1], r[2]}; }
  CRADLE_LANES Triple<V> angular() const { return {r[3], r[4], r[5]}; }
};
template <class V>
CRADLE_LANES LineRows<V> load_run(const BodyLine* lines) {
  LineRows<V> rows;
  load_line_rows(rows.r, [&](int l) CRADLE_LAMBDA { return numbers_of(lines + l); });
  return rows;
}
template <class V>
CRADLE_LANES void store_run(BodyLine* lines, const Triple<V>& linear, const Triple<V>& angular,
                            const V& inverse_mass = V{}, const V& inverse_moment = V{}) {
  V rows[kLineNumbers] = {linear.x,  linear.y,  linear.z,     angular.x,
                          angular.y, angular.z, inverse_mass, inverse_moment};
  const auto line = [&](int l) CRADLE_LAMBDA { return numbers_of(lines + l); };
  store_line_rows(rows, line);
}

/// Of contacts, since `v` and `w`.
template <class V>
CRADLE_LANES bool note_changes(const BodyRun& run, int k, const Triple<V>& dv, const Triple<V>& dw,
                               const Triple<V>& v, const Triple<V>& w, double smooth_s) {
  const V smooth2 = smooth_s * smooth_s * load<V>(run.pull2 + k);
  const V gyration2 = load<V>(run.gyration2 + k);
  const auto is_struck = larger<V>(dot(dv, dv), gyration2 * dot(dw, dw)) > smooth2;
  store(run.struck + k, is_struck ? fill<V>(1) : V{});
  const V of_v = dot(dv, dv + 2 * v), of_w = dot(dw, dw + 2 * w);
  store(run.gains + k, 0.5 * load<V>(run.mass + k) * (of_v + gyration2 * of_w));
  return any<V>(is_struck);
}

template <class V>
CRADLE_LANES bool load_lanes(const BodyRun& run, int k, double h, double smooth_s) {
  const LineRows<V> now = load_run<V>(run.velocities + k), free = load_run<V>(run.frees + k);
  const LineRows<V> loads = load_run<V>(run.loads + k);
  const Triple<V> v = now.linear(), w = now.angular();
  const Triple<V> dv = v - free.linear(), dw = w - free.angular();
  __builtin_memcpy(run.begins + k, run.velocities + k, kLanes<V> * sizeof(BodyLine));
  const Triple<V> v_free = v + h * loads.linear(), w_free = w + h * loads.angular();
  store_run(run.frees + k, v_free, w_free);
  store_run(run.velocities + k, v_free + dv, w_free + dw, now.r[kInverseMass],
            now.r[kInverseMoment]);
  return note_changes(run, k, dv, dw, v_free, w_free, smooth_s);
}

template <class V>
CRADLE_LANES bool look_lanes(const BodyRun& run, int k, double smooth_s) {
  const LineRows<V> now = load_run<V>(run.velocities + k), free = load_run<V>(run.frees + k);
  const Triple<V> v = free.linear(), w = free.angular();
  return note_changes(run, k, now.linear() - v, now.angular() - w, v, w, smooth_s);
}

template <class V>
CRADLE_LANES void move_lanes(const BodyRun& run, int k, double h, double smooth_s) {
  const LineRows<V> now = load_run<V>(run.velocities + k), before = load_run<V>(run.begins + k);
  const LineRows<V> motion = load_run<V>(run.motions + k);
  const Triple<V> v = before.linear(), w = before.angular();
  const Triple<V> dv = now.linear() - v, dw = now.angular() - w;
  const V smooth2 = smooth_s * smooth_s * load<V>(run.mean_pull2 + k);
  const auto is_smooth = dot(dv, dv) <= smooth2;
  const V turning2 = load<V>(run.mean_gyration2 + k) * dot(dw, dw);
  const auto turns_smoothly = is_smooth & (turning2 <= smooth2);
  store_run(run.motions + k, motion.linear() + h * select(is_smooth, v + 0.5 * dv, now.linear()),
            motion.angular() + h * select(turns_smoothly, w + 0.5 * dw, now.angular()));
}

/// Calls `f(V, line)` for whole vectors, and one by one for what is left.
template <class V, class F>
CRADLE_LANES void for_lines(const BodyRun& run, F&& f) {
  int k = run.begin;
  for (; k + kLanes<V> <= run.end; k += kLanes<V>) f(V{}, k);
  for (; k < run.end; ++k) f(double{}, k);
}

template <class V>
struct BodyPasses {
  static bool load(const BodyRun& run, double h, double smooth_s) {
    bool any = false;
    for_lines<V>(run, [&](auto v, int k)
                          CRADLE_LAMBDA { any |= load_lanes<decltype(v)>(run, k, h, smooth_s); });
    return any;
  }
  static bool look(const BodyRun& run, double smooth_s) {
    bool any = false;
    for_lines<V>(run, [&](auto v, int k)
                          CRADLE_LAMBDA { any |= look_lanes<decltype(v)>(run, k, smooth_s); });
    return any;
  }
  static void move(const BodyRun& run, double h, double smooth_s) {
    for_lines<V>(
        run, [&](auto v, int k) CRADLE_LAMBDA { move_lanes<decltype(v)>(run, k, h, smooth_s); });
  }
  static void average(const BodyRun& run, BodyLine* means) {
    for (int k = run.begin; k < run.end; ++k) {
      for (int part = 0; part < kLineNumbers; part += kLanes<V>) {
        const V before = cradle::load<V>(run.begins[k].all + part);
        store(means[k].all + part, 0.5 * (before + cradle::load<V>(run.velocities[k].all + part)));
      }
    }
  }
};

}  // namespace
}  // namespace cradle
