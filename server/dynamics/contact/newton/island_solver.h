/// The velocities and impulses of an island in a tick, by the contact solver "newton": see
/// island_solver.cpp.
#pragma once

#include "server/dynamics/contact/newton/minimise.h"

namespace cradle {

/// Who and what an island is, and room for its matrix, which is best left to it.
struct Island {
  std::vector<std::int32_t> slots;  ///< of its bodies, ascending
  std::vector<ContactConstraint*> constraints;
  BlockCholesky H;
};

/// Keeps its memory from island to island.
class IslandSolver {
 public:
  /// Bodies have their velocities after loads. False where it finds none; then nothing has changed.
  bool solve(const BodyLines& bodies, const BodyArrays& arrays, Island& island, double dt);

  // Of the last island that was solved.

  /// By line: velocities that move places, and those at the tick's end.
  void store(std::span<BodyLine> ways, std::span<BodyLine> ends) const;
  /// Impulses, to the constraints; and how well they do.
  void keep(ContactResidual& residual);

 private:
  void set_targets(const BodyLines& bodies);
  void set_bounces(const BodyLines& bodies);
  double scale() const;
  void start();
  bool find();
  bool find_by_softer();
  bool find_slip(int iterations_max);
  bool minimise(int iterations_max);
  void update_slip();
  double slip_error();
  bool is_pushed() const;
  void stop_pushing();

  Island* of_ = nullptr;
  double dt_ = 0;
  ContactIsland contacts_;
  Minimiser minimiser_;
  double tolerance_ = 0, scale_ = 0;
  Eigen::VectorXd x_, last_, way_;
};

}  // namespace cradle
