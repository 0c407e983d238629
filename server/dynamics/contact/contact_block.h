/// What the wide kernels of contact and their caller agree on. Plain numbers: the kernels' files
/// are compiled for one instruction set each and must share no inline code with others.
///
/// A manifold acts at its centre c, in the frame n, t1, t2 = n x t1, on the bodies' relative twist
/// there; its points lie in the plane at c + u t1 + v t2. Symbols as in contact_method.h.
#pragma once

#include <cstdint>

#include "server/dynamics/contact/softness.h"

namespace cradle {

/// Manifolds a block, whatever the kernel's width: a number of each fills a line of the cache.
template <class Real>
inline constexpr int kBlockLanes = 64 / sizeof(Real);
/// Points of a manifold are solved at once in double precision alone: the inverse of K is no good
/// else (contact_method.h).
template <class Real>
inline constexpr bool kMayJoin = sizeof(Real) == sizeof(double);
inline constexpr int kBlockPoints = 4;
inline constexpr int kBlockKinds = 10;  ///< of runs: points, joint or not, bodies round or not
/// Of contacts with restitution: they do not slow down what comes (impacts.h).
inline constexpr double kImpactHaste = 1e9;

/// What the kernels see of a ContactConstraint: lines of eight numbers, by where they begin.
struct ConstraintLines {
  static constexpr int kFrame = 0;    ///< n, t1, friction, preload
  static constexpr int kBodies = 8;   ///< from_B, 1/m of A and of B, restitution
  static constexpr int kMasses = 24;  ///< K_normals, and four others
  static constexpr int kPoints = 32;  ///< a line each: rA, s0, then
  static constexpr int kLoad = 4;     ///< force_t, force, press
};

/// Manifolds side by side, which share no body that yields, in double or single precision. Of
/// points that are missing, masses and impulses are 0; so is everything in lanes without a
/// manifold.
template <class Real>
struct ContactBlock {
  static constexpr int kLanes = kBlockLanes<Real>;
  using Row = Real[kLanes];
  // What all passes of a sub-step read lies side by side, points after each other, and what some
  // runs have no use for comes last.
  alignas(64) Row n[3], t1[3];
  Row arm_A[3], arm_B[3];  ///< m, from Bcm to c
  // Where the bodies' lines begin, by numbers, so that an address takes no shift.
  std::int32_t a[kLanes], b[kLanes];          ///< to read
  std::int32_t a_out[kLanes], b_out[kLanes];  ///< and to write: of bodies that yield
  Row part;                                   ///< of its impulses: for `repeat` and `scale`
  Row friction;
  Row gap_haste;  ///< a gap may close in so much less than a sub-step: 1, or kImpactHaste
  struct Point {
    Row u, v;      ///< m
    Row s;         ///< m, at the last evaluation
    Row yields;    ///< 1/K along n; kg
    Row lambda;    ///< N s, of a sub-step
    Row s0;        ///< m, at the tick's start
    Row yields_t;  ///< 1 / the largest K in the tangent plane; kg
    Row lambda_1, lambda_2;
  };
  Point points[kBlockPoints];
  Row coupling[6];    ///< K between points 01 02 03 12 13 23; 1/kg
  Row response_t[6];  ///< of (V1, V2, Wn) to (P1, P2, Tn): 11 12 1n 22 2n nn
  Row inverse_inertia_A[6], inverse_inertia_B[6];  ///< xx xy xz yy yz zz; unset if `is_round`
  // See contact_method.h; of runs that are `joint`.
  Row inverse_soft[10], inverse_hard[10];
  Row inverse_t[6];             ///< 1/response_t: 11 12 1n 22 2n nn
  Row share, lever_share;       ///< 1 / points, 1 / sum of u^2 + v^2
  Row sink_share;               ///< 1 - preload
  double* lines[kLanes];        ///< of its constraint; zeros where there is none
  std::int32_t source[kLanes];  ///< which constraint; -1: none
};

inline constexpr int kLineNumbers = 8;

/// v and w, or displacement and turn since the tick's start, of one body.
struct BodyLine {
  /// Linear, angular; with velocities 1/m and, of bodies with equal moments, 1/J: how it yields.
  alignas(64) double all[kLineNumbers];
};
/// Where they begin.
inline constexpr int kAngular = 3, kInverseMass = 6, kInverseMoment = 7;
static_assert(sizeof(BodyLine) == kLineNumbers * sizeof(double));

/// Bodies in contact that yield, a line each, and what is known of them, a number each.
struct BodyRun {
  BodyLine *velocities, *motions;
  BodyLine *begins, *frees;      ///< velocities before loads; after loads, before contacts
  const BodyLine* loads;         ///< what they give, in a second
  const double* pull2;           ///< (m/s^2)^2, of its acceleration
  const double* gyration2;       ///< m^2, largest moment by mass
  const double* mean_pull2;      ///< as pull2; below 0: moves with its last velocity
  const double* mean_gyration2;  ///< as gyration2; infinite: turns with its last velocity
  const double* mass;            ///< kg
  double* struck;                ///< 1: its contacts changed it by more than its loads would
  double* gains;                 ///< J: what they gave, of bodies with equal moments
  std::int32_t begin, end;       ///< lines
};

struct SubStep {
  double h, rate;  ///< s, and how many there are in one
  double push_speed, push_rate;
  Softness soft;
};

/// Blocks of manifolds with `points` points each: 1, 2 or 4. If `joint`, a manifold's points are
/// solved at once; else one after another, as all are in single precision. If `is_round`, all
/// bodies have equal moments, or do not yield: one number instead of a matrix.
template <class Real>
struct BlockRun {
  ContactBlock<Real>* blocks;
  std::int32_t count;
  std::int32_t points;
  bool joint;
  bool is_round;
  std::int32_t task;  ///< no other run of this one is solved at the same time
};

/// Residuals of points, by lane, as contact_balance.h says: largest, and sums of squares.
template <class Real>
struct ContactTally {
  using Row = typename ContactBlock<Real>::Row;
  Row natural2, signorini, cone, complementarity;
  Row natural2_sum, impulse2_sum, velocity2_sum;
};
/// What impulses did, by lane, J; and N s, by bodies that do not yield, on others.
template <class Real>
struct ContactWork {
  using Row = typename ContactBlock<Real>::Row;
  Row normal, friction, driven, momentum[3];
};

/// How blocks are filled from constraints.
template <class Real>
struct BlockFilling {
  const BodyLine* responses;  ///< inverse inertia xx xy xz yy yz zz
  double h;                   ///< s, of a sub-step
  double give;                ///< s^2: softness.h
  double excess;              ///< ContactConstraint::lasting_load
  /// By point, m/s^2: of PointRest; null: all 0.
  const typename ContactBlock<Real>::Row* rest_loads;
};
/// How constraints take their results.
struct BlockTaking {
  double h;              ///< s, of a sub-step
  double growth, decay;  ///< of what presses: soft_batch.cpp
  double give;           ///< s^2: softness.h
};

/// What is done with blocks.
template <class Real>
struct BlockPasses {
  using Run = BlockRun<Real>;
  /// All rows that stand for the constraint, at the tick's start. `yields` is 1 already for points
  /// that there are, and 0 for others.
  void (*gather)(const Run&, const BlockFilling<Real>&);
  /// The loads of the points; `sag`: by lane, the largest so far, m.
  void (*scatter)(const Run&, const BlockTaking&, Real* sag);
  void (*prepare)(const Run&, const Softness&, const BodyLine* velocities);
  void (*warm_start)(const Run&, BodyLine* velocities);
  void (*repeat)(const Run&, BodyLine* velocities);  ///< a warm start by that part alone
  void (*scale)(const Run&);                         ///< leaves that part
  void (*solve)(const Run&, const SubStep&, BodyLine* velocities);
  void (*relax)(const Run&, const SubStep&, BodyLine* velocities, const BodyLine* motions);
  void (*judge)(const Run&, const SubStep&, const BodyLine* velocities, ContactTally<Real>&);
  void (*work)(const Run&, const BodyLine* means, ContactWork<Real>&);
};

struct ContactKernels {
  int lanes;  ///< of doubles
  /// Loads over `h`, and what contacts gave in the sub-step before, again. True if this struck
  /// anybody: it would not have come from loads in `smooth_s`.
  bool (*load)(const BodyRun&, double h, double smooth_s);
  /// Likewise, of what contacts gave since loads.
  bool (*look)(const BodyRun&, double smooth_s);
  /// With the mean velocity of the sub-step where that is smooth, else the last.
  void (*move)(const BodyRun&, double h, double smooth_s);
  /// Velocities before and after the sub-step, halved.
  void (*average)(const BodyRun&, BodyLine* means);
  BlockPasses<double> doubles;
  BlockPasses<float> floats;

  template <class Real>
  const BlockPasses<Real>& of() const {
    if constexpr (sizeof(Real) == sizeof(float)) {
      return floats;
    } else {
      return doubles;
    }
  }
};

extern const ContactKernels kContactKernels1, kContactKernels2;
#ifdef CRADLE_WIDE_X86
extern const ContactKernels kContactKernels4;  ///< needs AVX2
extern const ContactKernels kContactKernels8;  ///< needs AVX-512 F, VL, DQ
#endif

}  // namespace cradle
