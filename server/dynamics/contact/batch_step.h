/// A tick of the islands of a batch: they take the same number of sub-steps, and have the same
/// past.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/dynamics/contact/domains.h"
#include "server/dynamics/contact/soft_batch.h"

namespace cradle {

/// What its contacts and bodies have come to; sums of batches are made in the order of batches.
struct BatchResult {
  int impacts_ordered = 0;
  double paid_J = 0;
  double sag_m = 0;  ///< of the most loaded contact, expected of loads that last
  ContactResidual residual;
  ContactBalance balance;
};

/// Keeps its memory from batch to batch. Batches share no body that yields: steps of different ones
/// may go side by side.
class BatchStep {
 public:
  struct Batch {
    int sub_steps, stiff_as;  ///< as ContactTick has them
    bool in_floats;           ///< as IslandFacts has it
    Past past;
    // Of its bodies, which are sorted by domain:
    std::span<std::int32_t> moving, islands;  ///< slots; by number, of those in the tick
    std::span<std::uint8_t> resting;          ///< as ContactTick has it
    std::span<ContactConstraint* const> constraints;
    std::span<ContactConstraint* const> special;  ///< those of them that are, as ContactLook has it
  };
  /// `sizes`: bodies, by island of the tick.
  BatchResult advance(const Batch& batch, ContactTick tick, const BodyArrays& arrays,
                      std::span<const Matrix> inverse_inertia_W, std::span<const int> sizes);

 private:
  void divide(const Batch& batch, ContactTick& tick, const BodyArrays& arrays,
              std::span<const int> sizes);
  void set_gaps(Executor& executor, std::span<ContactConstraint* const> constraints, double give);
  void reset_gaps(Executor& executor, std::span<ContactConstraint* const> constraints);

  SoftBatch<double> batch_;
  SoftBatch<float> batch_in_floats_;
  Domains domains_;
  std::vector<std::int32_t> numbers_;                      // room to sort
  std::vector<std::uint8_t> flags_;                        // likewise
  std::vector<std::array<double, kManifoldPoints>> gaps_;  // m: s0 of points, by special constraint
};

}  // namespace cradle
