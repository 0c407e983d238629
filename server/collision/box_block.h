/// What the wide kernels of boxes and their callers (box_box.cpp, box_grid.h) agree on. Plain
/// numbers: the kernels' files are compiled for one instruction set each and must share no inline
/// code with others. Symbols as in box_box.cpp; m.
#pragma once

#include <cstddef>
#include <cstdint>

namespace cradle {

inline constexpr int kBoxLanes = 8;  ///< pairs a block, whatever the kernel's width
inline constexpr int kBoxCandidates = 12;
/// Sides of the reference face: 1 x+, 2 x-, 3 y+, 4 y-; or none.
inline constexpr double kNoSide = 0;

/// Eight pairs of boxes, and what their axes tell.
struct BoxAxesBlock {
  using Row = double[kBoxLanes];
  alignas(64) Row h_A[3], h_B[3];
  Row margin;
  /// What of the last manifold may be kept, if there are more than four candidates again: a sum of
  /// 2^c, as `set`, of faces as `faces`; 0: nothing.
  Row last_set, last_faces;
  Row met_by_edges;  ///< 1: or by corners, last time
  // Results, but for the margin that of a lane without a pair is negative.
  Row C[9], t[3];  ///< B as A sees it: columns of C
  Row u[3];        ///< t as B sees it
  /// Of the faces of A, and of B: the best s, its axis, and the largest s of the other axes, and of
  /// this one the other way round.
  Row s_A, axis_A, next_A, s_B, axis_B, next_B;
  /// Of the edges that cross: the best s, 3 i + j, and the largest s of edges that are just too
  /// parallel to count. Minus infinity if there are none. Neither these nor what follows is set
  /// where faces part all pairs of a vector by more than their margin.
  Row s_edge, edge;
  Row slack, bias;  ///< for boxes of this size, see tolerances.h
  Row least_edge;   ///< edges of a larger s part the boxes better than any face
  Row on_A;         ///< 1: the reference face is of A; 0: of B
};

/// Eight incident faces over reference faces, in the frame F of the reference face: origin in its
/// middle, z along the normal toward the incident box, x and y along the axes that follow its own.
struct BoxFaceBlock : BoxAxesBlock {
  /// Twice the axis of the box, and 1 more on its upper side.
  Row reference, incident;
  Row faces;         ///< both and `on_A` in a number above 0
  Row s;             ///< of the reference face
  Row lead;          ///< of its direction over others
  Row until_tilted;  ///< what the boxes may move until the faces are flush no more, if they are;
                     ///< else none, or less
  /// Candidates 2k and 2k+1 are where the edge from incident corner k to the next one enters the
  /// reference face and where it leaves it; 8 to 11 are reference corners.
  Row x[kBoxCandidates], y[kBoxCandidates], z[kBoxCandidates];
  /// That candidates 0 to 7 are cut by; none: the corner. Of the others 5 and the reference corner.
  Row side[kBoxCandidates];
  Row set;    ///< of candidates that are near enough, or the four of them to keep: sum of 2^c
  Row bears;  ///< what the boxes may move until all candidates have left the face, or one has slid
              ///< far
  // What is to be made of these, see box_verdict.h.
  Row apart;   ///< 1: an axis parts the boxes
  Row missed;  ///< the boxes overlap by so much more than the deepest point; infinite: there is
               ///< none
  Row counts;  ///< 1: the face does, where it does not lean
  Row stays;   ///< then: what the boxes may move until it is another contact
  Row lowered[kBoxCandidates];  ///< then: z, the deepest as deep as the boxes overlap
};

struct BoxPairBlock : BoxFaceBlock {
  using Numbers = const double* [kBoxLanes];  ///< of a box each, where the world has them
  Numbers half_A, half_B;                     ///< half extents
  Numbers X_WA, X_WB;                         ///< centre, then axes
};

/// Of what is chosen: `faces` times 2^12, and `set`; or that edges or corners met.
inline constexpr unsigned kSetOfChoice = (1u << kBoxCandidates) - 1;
inline constexpr unsigned kEdgesOfChoice = 1u << 31;

/// Signs of a quadrilateral's corners along e and f, and x and y, in order.
inline constexpr double kSignX[4] = {1, -1, -1, 1};
inline constexpr double kSignY[4] = {1, 1, -1, -1};

/// Boxes along W's axes in the order of a grid's cells: lower x, y, z, upper x, y, z, a column
/// each, with room behind for a vector's read that begins at the last.
struct GridBoxes {
  const float* bounds;
  std::size_t stride;  ///< of columns
};
inline constexpr std::size_t kGridLanes = 16;  ///< floats a vector, at most
/// Of such boxes.
struct GridRange {
  std::uint32_t begin, end;
};

/// `separate` and `clip` work on the first `pairs` lanes at least, `clip` after `separate`.
struct BoxKernels {
  int lanes;
  void (*separate)(BoxPairBlock&, int pairs);
  void (*clip)(BoxFaceBlock&, int pairs);
  /// Writes the places of the boxes in these ranges that overlap the one at `box`, in order, to
  /// `found`, which has room for all and kGridLanes more. Returns how many there are.
  std::size_t (*find_overlaps)(const GridBoxes&, std::uint32_t box, const GridRange* ranges,
                               std::size_t count, std::uint32_t* found);
};

extern const BoxKernels kBoxKernels1, kBoxKernels2;
#ifdef CRADLE_WIDE_X86
extern const BoxKernels kBoxKernels4;  ///< needs AVX2
extern const BoxKernels kBoxKernels8;  ///< needs AVX-512 F, VL, DQ
#endif

}  // namespace cradle
