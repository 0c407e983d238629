/// Pairs of boxes, many at a time. Private to this folder: others go by narrow_phase.h.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "server/collision/box_block.h"
#include "server/collision/collider.h"
#include "server/collision/manifold.h"

namespace cradle {

/// Two boxes as A sees them, and which of their edges part them best.
struct BoxAxes {
  struct Edges {
    double s;  ///< separation, m
    int i, j;
  };
  Vector h_A, h_B;
  Matrix C;  ///< axes of B, as columns
  Vector t;  ///< from A's centre to B's
  Edges edges;
};

BoxAxes axes_of(const BoxAxesBlock& block, int lane);
void copy_lane(const BoxAxesBlock& from, int lane, BoxAxesBlock& to, int to_lane);

/// Collects pairs until there is a block of them. A manifold does not depend on who else is in it.
/// Those that touched last time are apart from the others: faces are then put over each other where
/// axes were tried, with few lanes in vain.
class BoxBatch {
 public:
  /// `lanes`: one of machine_lanes(), or 0: the most. The manifolds are the same at each.
  explicit BoxBatch(MadeManifolds& made, int lanes = 0);

  /// Shapes and poses must last until they are made. `foresight`: m, of two that meet within the
  /// margin, how far beyond it further points are told.
  void add(std::size_t key, const Collider& A, const Collider& B, double margin,
           double foresight = 0, std::uint64_t choice = 0);
  /// Makes the manifolds of the pairs that wait.
  void finish();

 private:
  struct Waiting {
    std::size_t key;
    const Shape *A, *B;
    const Pose *X_WA, *X_WB;
    double margin;
  };
  /// Meets along faces.
  struct Facing {
    const Waiting& pair;
    const BoxFaceBlock& block;
    int lane;

    struct Face {
      int axis;
      Vector axis_W;
      std::array<int, 2> edges;
      std::array<Vector, 2> edges_W;
    };

    bool on_A() const { return block.on_A[lane] > 0; }
    bool is_flush() const { return block.until_tilted[lane] > 0; }
    bool is_apart() const { return block.apart[lane] > 0; }
    static Face face(const Pose& X_WB, double number);
    /// Of A, or else of B. Which it is is chance, so: no branch.
    const Pose& pose(bool of_A) const {
      const Pose* const poses[] = {pair.X_WB, pair.X_WA};
      return *poses[of_A ? 1 : 0];
    }
    const Pose& reference_pose() const { return pose(on_A()); }
    const Pose& incident_pose() const { return pose(!on_A()); }
    Face reference() const { return face(reference_pose(), block.reference[lane]); }
    Face incident() const { return face(incident_pose(), block.incident[lane]); }
    void set(Manifold& manifold) const;
    bool are_nearest(int of_reference, int of_incident) const;
    double separation_along(const Vector& n) const;
    bool lean(Manifold& at_face) const;
    bool set_if_it_counts(Manifold& manifold) const;
    Facing alone(bool face_of_A, BoxFaceBlock& own) const;
    void add_rest_of_faces(Manifold& manifold) const;
    bool meet_by_edges(Manifold& manifold) const;
    void meet_beside_faces(Manifold& manifold) const;
    void meet(Manifold& manifold) const;
  };

  /// Pairs whose axes are to be tried together.
  struct Queue {
    int waiting = 0;
    std::array<Waiting, kBoxLanes> pairs;
    BoxPairBlock block;
  };

  void separate(Queue& queue);
  void wait(const Queue& queue, int lane);
  void clip();
  void clip(BoxFaceBlock& block, const std::array<Waiting, kBoxLanes>& pairs,
            std::span<const int> lanes);

  MadeManifolds& made_;
  const BoxKernels& kernels_;
  std::array<Queue, 2> queues_;  ///< the second: of what touched last time, nearly all does again
  int facing_ = 0;
  std::array<Waiting, kBoxLanes> faces_;
  BoxFaceBlock face_block_;
};

}  // namespace cradle
