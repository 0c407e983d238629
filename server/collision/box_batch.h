/// Pairs of boxes, many at a time. Private to this folder: others go by narrow_phase.h.
#pragma once

#include <array>
#include <cstddef>

#include "server/collision/box_block.h"
#include "server/collision/box_faces.h"
#include "server/collision/collider.h"
#include "server/collision/manifold.h"

namespace cradle {

/// What the axes of two boxes tell. `s`: separation along the best one, m; `next`: a bound on that
/// along the others.
struct BoxAxes {
  struct Face {
    double s;
    int axis;
    double next;
  };
  struct Edges {
    double s;
    int i, j;
    double next;
  };
  Vector h_A, h_B;
  Matrix C;     ///< axes of B as A sees them, as columns
  Vector t, u;  ///< from A's centre to B's, as A sees it, and as B does
  Face face_A, face_B;
  Edges edges;
};

/// Collects pairs until there is a block of them. A manifold does not depend on who else is in it.
class BoxBatch {
 public:
  /// `lanes`: one of machine_lanes(), or 0: the most. The manifolds are the same at each.
  explicit BoxBatch(MadeManifolds& made, int lanes = 0);

  /// Shapes and poses must last until they are made.
  void add(std::size_t key, const Collider& A, const Collider& B, double margin);
  /// Makes the manifolds of the pairs that wait.
  void finish();

 private:
  struct Waiting {
    std::size_t key;
    const Shape *A, *B;
    const Pose *X_WA, *X_WB;
    double margin;
  };
  /// Along faces, with the lengths that decide.
  struct Facing {
    Waiting pair;
    BoxAxes axes;
    double slack, bias, face, edge_bias, upright;
    bool on_A, is_flush, is_apart;
    BoxFaces names;

    void prefer(bool face_of_A);
  };

  void separate();
  void judge(const Waiting& pair, int lane);
  void clip();
  static bool over_face(const Facing& facing, const ContactPoint& point);
  static bool counts(const Facing& facing, Manifold& at_face, double& missed);
  static double lead_of(const Facing& facing, Manifold& manifold, double bears, double missed);
  void meet_faces(const Facing& facing, Manifold& manifold) const;
  static void clip_alone(const Facing& facing, Manifold& manifold);

  MadeManifolds& made_;
  const BoxKernels& kernels_;
  int waiting_ = 0, facing_ = 0;
  std::array<Waiting, kBoxLanes> waits_;
  std::array<Facing, kBoxLanes> faces_;
  BoxPairBlock pair_block_;
  BoxFaceBlock face_block_;
};

}  // namespace cradle
