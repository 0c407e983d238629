#include "tests/bench/cases.h"

#include <algorithm>
#include <iterator>

namespace cradle::bench {
namespace {

// Ten ticks at 60 Hz: arrays have grown, caches are warm.
constexpr double kTenTicks_s = 10.0 / 60;

constexpr Case kSceneCases[] = {
    {"T1", "bench_gas.toml", 6, 1, drift_of_kinetic_energy, "kinetic energy, relative",
     "10 000 elastic spheres in a closed box"},
    // The fall is part of the pile: every tick counts.
    {"T2", "bench_pile.toml", 5, 0, mean_penetration_at_end, "mean penetration at the end, m",
     "2000 cubes dropped into a pit", 1, true},
    {"T3", "bench_pyramid.toml", 10, kTenTicks_s, displacement, "max displacement, m",
     "a wall pyramid of 465 cubes"},
    {"T4", "bench_free.toml", 110.0 / 60, kTenTicks_s, drift_of_rotational_energy,
     "rotational energy, relative", "100 000 free bodies without shapes"},
    {"T4m", "bench_free_million.toml", 40.0 / 60, kTenTicks_s, drift_of_rotational_energy,
     "rotational energy, relative", "a million of them"},
    {"T4p", "bench_free_planar.toml", 110.0 / 60, kTenTicks_s, drift_of_rotational_energy,
     "rotational energy, relative", "100 000 of them in a planar world"},
    {"T5", "bench_terrain.toml", 5, 0, bodies_below_terrain, "bodies that went below the terrain",
     "3000 bodies of four shapes dropped on a mesh", 30, true},
    {"A1", "bench_projectile.toml", 10, kTenTicks_s, distance_from_parabola,
     "max distance from the parabola, m", "a projectile"},
    {"A2", "bench_torque_free.toml", 60, kTenTicks_s, drift_of_tumbling,
     "energy or angular momentum, relative", "a free body turning about its middle axis"},
    {"A3", "bench_bounce.toml", 10, kTenTicks_s, apexes_by_poses,
     "worst of five apexes by poses, relative", "a sphere that bounces, restitution 0.8"},
    {"A3e", "bench_bounce.toml", 10, kTenTicks_s, apexes_by_energy,
     "worst of five apexes by energy, relative", "the same"},
    {"A4", "bench_slide.toml", 3, kTenTicks_s, stopping_distance, "stopping distance, relative",
     "a box that slides to a stop"},
    {"A5", "bench_roll.toml", 2, kTenTicks_s, rolling_speed, "final velocity, relative",
     "a sphere that slides until it rolls"},
    {"A5t", "bench_roll.toml", 2, kTenTicks_s, end_of_slip, "time of the end of slip, relative",
     "the same"},
    {"A6a", "bench_slope_rest.toml", 10, kTenTicks_s, creep_on_slope, "creep, m/s",
     "a cube on a slope of 0.9 times its friction"},
    {"A6b", "bench_slope_slide.toml", 4, kTenTicks_s, acceleration_on_slope,
     "acceleration, relative", "a cube on a slope of 1.2 times its friction"},
    {"A7", "bench_stack.toml", 60, kTenTicks_s, horizontal_drift, "max horizontal drift, m",
     "a stack of twenty cubes"},
    {"A8a", "bench_heavy_on_one.toml", 10, kTenTicks_s, displacement, "max displacement, m",
     "1000 kg on a cube of 1 kg"},
    {"A8b", "bench_heavy_on_ten.toml", 10, kTenTicks_s, displacement, "max displacement, m",
     "1000 kg on ten cubes of 1 kg"},
    {"A9", "bench_cradle_one.toml", 2, kTenTicks_s, cradle_speeds, "worst final velocity, m/s",
     "Newton's cradle, one in"},
    {"A9b", "bench_cradle_two.toml", 2, kTenTicks_s, cradle_speeds, "worst final velocity, m/s",
     "Newton's cradle, two in"},
    {"A10", "bench_fast_sphere.toml", 1, kTenTicks_s, passage_through_wall,
     "beyond the near face or still moving, m", "1000 m/s against a wall of 2 cm"},
    {"A11", "bench_elastic_box.toml", 30, kTenTicks_s, drift_of_kinetic_energy,
     "kinetic energy, relative", "216 elastic spheres in a closed box"},
    {"A12", "bench_overlap.toml", 1, kTenTicks_s, parting_speed, "max speed, m/s",
     "two cubes that overlap by half"},
    {"P29", "bench_large_pyramid.toml", 10.0 / 3, kTenTicks_s, horizontal_drift,
     "max horizontal drift, m", "a pyramid of 5050 cubes, 200 steps"},
    {"S1", "bench_rolling.toml", 4, kTenTicks_s, pushed_from_under, "mean square, (m/s)^2",
     "SimBenchmark: a box pulled from under spheres"},
    {"S1t", "bench_rolling_turned.toml", 4, kTenTicks_s, pushed_from_under, "mean square, (m/s)^2",
     "the same at 60 degrees"},
    {"S2", "bench_bouncing_balls.toml", 20, kTenTicks_s, mean_square_energy_change,
     "mean square of the energy's change, J^2", "SimBenchmark: 49 elastic spheres bounce"},
    {"S3", "bench_666.toml", 10, kTenTicks_s, mean_square_overlap, "mean square of overlaps, m^2",
     "SimBenchmark: a lattice of spheres falls apart"},
    {"S4", "bench_666_elastic.toml", 10, kTenTicks_s, mean_square_energy_change,
     "mean square of the energy's change, J^2", "SimBenchmark: the same, elastic, from 1 m"},
};

}  // namespace

std::span<const Case> cases() { return kSceneCases; }

const Case* find_case(std::string_view name) {
  const auto found = std::find_if(std::begin(kSceneCases), std::end(kSceneCases),
                                  [&](const Case& candidate) { return candidate.name == name; });
  return found == std::end(kSceneCases) ? nullptr : found;
}

}  // namespace cradle::bench
