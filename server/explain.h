/// `cradled explain`: what the scene's bodies do without, why, and how wrong that may be.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/dynamics/flight_error.h"
#include "server/simulate.h"

namespace cradle {

/// What a body can do without.
enum class Omission {
  rotation,
  gyroscopic_term,
  torque_series,
  third_dimension,
  common_rate,
  sub_steps,
  contact
};
inline constexpr std::size_t kOmissions = 7;

/// One of them, over a run.
struct Saving {
  std::int64_t bodies = 0;   ///< that did without it, in some tick or in all
  std::int64_t bounded = 0;  ///< of them, those with a bound
  double distance_m = 0;     ///< bound, of any point of any of them, at the end; all they left out
  double angle_rad = 0;      ///< likewise, of the attitude; both as Explanation::Bound
};

/// Follows a run tick by tick. Bodies that come into contact are counted, and no longer bounded
/// from then on; so are those that move one by one: with drag, springs or another scheme.
class Explanation {
 public:
  /// `run` must not have begun; it outlives this.
  explicit Explanation(SceneRun& run);

  /// One tick.
  void step(Executor& executor);

  std::array<Saving, kOmissions> savings() const;

  /// Where the errors have grown beyond what can be bounded, the distance is infinite and the angle
  /// pi: no two attitudes are farther apart.
  struct Bound {
    double distance_m, angle_rad;
    bool is_known() const { return std::isfinite(distance_m); }
  };
  /// Of one body of the scene; false if it has none: it touched, or moved one by one.
  bool bound(std::size_t body, Bound& bound) const;

  std::int64_t touching() const;  ///< bodies that were in contact
  std::int64_t one_by_one() const;
  int sub_steps_most() const { return sub_steps_most_; }  ///< of bodies in contact
  /// Of the last tick in which somebody awake was in contact; 0: there was none.
  std::span<const SubStepChoice> choices() const { return choices_; }
  Tick choices_tick() const { return choices_tick_; }
  double penetration_most_m() const { return penetration_most_m_; }
  double steps_most() const { return steps_most_; }  ///< of any free body in a tick

 private:
  struct Body {
    std::array<bool, kOmissions> does_without{};
    bool touched = false, was_alone = false;
    double reach_m = 0;   // farthest point from Bo
    double offset_m = 0;  // of Bcm from Bo
    double place_m = 0;   // of Bcm from the world's origin
    FlightError error;
    bool is_bounded() const { return !touched && !was_alone; }
  };

  void look(Body& body, const FlightAccount& account, double full_steps);

  SceneRun& run_;
  std::vector<Body> bodies_;
  double steps_most_ = 1;
  int sub_steps_most_ = 0;
  double penetration_most_m_ = 0;
  std::vector<SubStepChoice> choices_;
  Tick choices_tick_ = 0;
};

/// What was chosen for bodies in contact, when there were some for the last time, and the error to
/// expect. Part of the table below.
std::string describe_sub_steps(const Explanation& explanation, const WorldSettings& settings);

/// The table for people, of a run of `ticks`.
std::string to_text(const Explanation& explanation, const SceneRun& run, std::int64_t ticks);

struct ExplainOptions {
  std::string scene;                  ///< path
  double duration_s = 1;              ///< rounded to whole ticks, 1 or more
  std::optional<double> dt_s;         ///< as SimulateOptions
  std::optional<std::string> scheme;  ///< likewise
};

/// Runs the scene and writes the table to standard output. Throws as `simulate`.
void explain(const ExplainOptions& options);

}  // namespace cradle
