/// Cases that contact solvers beside "soft" are measured by; their references are in the files
/// hard_cases_*.cpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/physics/standing.h"
#include "tests/physics/worlds.h"

namespace cradle {

inline WorldSettings settings_of(const std::string& solver,
                                 const Vec3& gravity_W = {0, 0, -kGravity}) {
  WorldSettings s = settings(60, gravity_W);
  s.solver = solver;
  s.balance_every = 1;
  return s;
}

struct Worst {
  double penetration_m = 0, momentum_Ns = 0, residual_mps = 0;
  int makeshift = 0, sub_steps = 0;

  void run(World& world, int ticks) {
    for (int k = 0; k < ticks; ++k) {
      const StepReport report = world.step();
      penetration_m = std::max(penetration_m, report.penetration_max_m);
      momentum_Ns = std::max(momentum_Ns, report.balance.momentum_unaccounted_Ns);
      residual_mps = std::max(residual_mps, report.residual_mps);
      sub_steps = std::max(sub_steps, report.sub_steps_max);
      makeshift += report.islands_makeshift;
    }
  }
};

inline std::vector<BodyId> add_stack(World& world, int cubes, double overlap_m = 0) {
  add(world, ground());
  std::vector<BodyId> bodies;
  for (int i = 0; i < cubes; ++i) {
    bodies.push_back(add(world, brick({0.5, 0.5, 0.5}, {0, 0, 0.5 + i - (i + 1) * overlap_m})));
  }
  return bodies;
}

/// Of two cubes that meet: cubes, since spheres bounce by events and meet no solver.
inline std::pair<Vec3, Vec3> after_meeting(const std::string& solver, double e) {
  World world(settings_of(solver, {}));
  BodySpec left = brick({0.5, 0.5, 0.5}, {-1, 0, 0}, {1, 0, 0});
  BodySpec right = brick({0.5, 0.5, 0.5}, {1, 0, 0}, {-1, 0, 0});
  left.material.restitution = right.material.restitution = e;
  const BodyId a = add(world, left), b = add(world, right);
  steps(world, 120);
  return {state(world, a).v_WBcm, state(world, b).v_WBcm};
}

/// One foot 1 m below: W = diag(12, 4, 3).
inline Standing drakes_body(double mu) {
  Standing body;
  body.set_mass(1.0 / 3, {1, 1.0 / 9, 1});
  body.v[1] = {-1, -1, -1};
  body.friction = mu;
  return body;
}

/// m, in 10 s on a slope of this angle, friction angle 26.565 degrees.
inline double creep(const std::string& solver, double degrees) {
  World world(settings_of(solver));
  const double a = degrees * std::acos(-1.0) / 180;
  BodySpec slope = ground();
  slope.q_WB = {std::cos(a / 2), 0, std::sin(a / 2), 0};
  BodySpec box = brick({0.5, 0.5, 0.25}, {0.25 * std::sin(a), 0, 0.25 * std::cos(a)});
  box.q_WB = slope.q_WB;
  add(world, slope);
  const BodyId body = add(world, box);
  steps(world, 30);
  const Vec3 begin = state(world, body).p_WBo;
  steps(world, 600);
  return distance(state(world, body).p_WBo, begin);
}

/// m, in 20 s (or less) of the uppermost of four bricks, that reach over by this part of the
/// harmonic series.
inline double overhang(const std::string& solver, double part, int ticks = 1200) {
  World world(settings_of(solver));
  BodySpec table = brick({2, 1, 0.5}, {-2, 0, -0.5});
  table.kind = BodyKind::fixed;
  add(world, table);
  BodyId top{};
  double end = 0;
  for (int k = 4; k >= 1; --k) {
    end += part / (2 * k);
    top = add(world, brick({0.5, 0.25, 0.1}, {end - 0.5, 0, 0.2 * (4 - k) + 0.1}));
  }
  const Vec3 before = state(world, top).p_WBo;
  steps(world, ticks);
  return distance(before, state(world, top).p_WBo);
}

}  // namespace cradle
