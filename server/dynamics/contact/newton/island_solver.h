/// The velocities and impulses of an island in a tick, by the contact solvers "newton" and
/// "accurate": see island_solver.cpp.
#pragma once

#include <limits>

#include "server/dynamics/contact/newton/minimise.h"

namespace cradle {

/// Who and what an island is, and room for its matrix, which is best left to it.
struct Island {
  std::vector<std::int32_t> slots;  ///< of its bodies, ascending
  std::vector<ContactConstraint*> constraints;
  BlockCholesky H;
};

struct IslandSettings {
  double yield;                ///< R by K, of what rests
  double tolerance;            ///< of the gradient
  double natural_map;          ///< relative, that what slides may have
  bool is_always_exact;        ///< and what rests, too
  std::size_t bodies_sliding;  ///< of an island; larger ones that slide are not tried
  bool is_flat = false;        ///< see ContactIsland
};
/// The tolerance: rounding of places makes 4e-6 of it (T3). The natural map: with 1e-4 or 1e-6 what
/// it leaves keeps a tower that was dropped from coming to rest ("ten tonnes"). Beyond 64 bodies
/// that slide the soft step is a hundred times as fast. "hybrid" takes rounding away (hand_over.h)
/// and asks for what lets each body of an island of thousands rest (settling.cpp); its points act
/// as they do in soft steps, or a load would not be the same after a hand-over (a pyramid, out of
/// place).
inline constexpr IslandSettings kNewton{1e-7, 1e-5, 1e-8, false, 64};
inline constexpr IslandSettings kHybrid{1e-7, 1e-6, 1e-8, false, 0, true};
inline constexpr IslandSettings kAccurate{1e-6, 1e-9, 1e-8, true, 1000};

/// Keeps its memory from island to island.
class IslandSolver {
 public:
  explicit IslandSolver(const IslandSettings& settings) : settings_(settings) {}

  /// Bodies have their velocities after loads. False where it finds none; then nothing has changed.
  bool solve(const BodyLines& bodies, const BodyArrays& arrays, Island& island, double dt);

  struct Budget {
    int iterations;
    /// Of what loads do in a tick: what is farther out of balance is not tried.
    double unbalanced = std::numeric_limits<double>::infinity();
  };
  /// Likewise, within a budget, of what does not part and hardly slides: "hybrid".
  bool solve_at_rest(const BodyLines& bodies, const BodyArrays& arrays, Island& island, double dt,
                     const Budget& budget);

  // Of the last island that was solved.

  /// Of its k-th body.
  double speed_mps(std::size_t k) const { return contacts_.speed(x_, k); }
  int iterations() const { return iterations_; }
  /// It moves by no more than rounding makes; then it does not move at all.
  bool is_still() const { return is_still_; }

  /// By line: velocities that move places, and those at the tick's end.
  void store(std::span<BodyLine> ways, std::span<BodyLine> ends) const;
  /// Impulses, to the constraints; and how well they do.
  void keep(ContactResidual& residual);
  /// It has the natural map that the settings ask for.
  bool is_exact() const { return is_exact_; }

 private:
  void begin(const BodyLines& bodies, const BodyArrays& arrays, Island& island, double dt);
  void set_targets(const BodyLines& bodies);
  void set_bounces(const BodyLines& bodies);
  double scale() const;
  void start();
  bool find();
  bool find_slip(int iterations_max);
  bool minimise(int iterations_max);
  bool find_by_rounds(double yield, int rounds_max);
  void hold();
  bool keep_better();
  void update_slip();
  double slip_error();
  bool is_pushed() const;
  void stop_pushing();

  Island* of_ = nullptr;
  double dt_ = 0;
  ContactIsland contacts_;
  Minimiser minimiser_;
  IslandSettings settings_;
  double tolerance_ = 0, scale_ = 0;
  Eigen::VectorXd x_, way_;
  bool is_exact_ = true, is_still_ = false;
  int iterations_ = 0;
  Eigen::VectorXd best_;
  std::vector<ContactIsland::Point> best_points_;
  double best_residual_ = 0;
};

}  // namespace cradle
