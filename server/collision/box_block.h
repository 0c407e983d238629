/// What the wide kernels of two boxes and their caller (box_box.cpp) agree on. Plain numbers: the
/// kernels' files are compiled for one instruction set each and must share no inline code with
/// others. Symbols as in box_box.cpp; m.
#pragma once

namespace cradle {

inline constexpr int kBoxLanes = 8;  ///< pairs a block, whatever the kernel's width
inline constexpr int kBoxCandidates = 12;
/// Sides of the reference face: 0 x+, 1 x-, 2 y+, 3 y-, or none.
inline constexpr double kNoSide = -1;

/// Eight pairs of boxes, and what separates them best. Lanes without a pair have a negative margin.
struct BoxPairBlock {
  using Row = double[kBoxLanes];
  alignas(64) Row h_A[3], h_B[3];
  Row R_A[9], R_B[9];  ///< columns of X_WA.R, X_WB.R
  Row d[3];            ///< from A's centre to B's, in W
  Row margin;
  // Results.
  Row C[9], t[3];  ///< B as A sees it: columns of C
  Row u[3];        ///< t as B sees it
  /// Of the faces of A, and of B: the best s, its axis, and the largest s of the other axes, and of
  /// this one the other way round.
  Row s_A, axis_A, next_A, s_B, axis_B, next_B;
  /// Of the edges that cross: the best s, 3 i + j, and the largest s of edges that are just too
  /// parallel to count. Not set where faces part all pairs of a vector by more than their margin;
  /// minus infinity if there are none.
  Row s_edge, edge, next_edge;
};

/// Eight incident faces over reference faces, in the frame F of the reference face: origin in its
/// middle, z along the normal toward the incident box.
struct BoxFaceBlock {
  using Row = double[kBoxLanes];
  alignas(64) Row half_x, half_y;  ///< of the reference face
  Row middle[3], e[3], f[3];       ///< of the incident face: e and f to the middles of two sides
  Row length_e, length_f;
  Row slope2;  ///< of its plane, m / m, squared
  Row slack, margin;
  // Results. Candidates 2k and 2k+1 are where the edge from incident corner k to the next one
  // enters the reference face and where it leaves it; 8 to 11 are reference corners.
  Row x[kBoxCandidates], y[kBoxCandidates], z[kBoxCandidates];
  /// That candidates 0 to 7 are cut by; none: the corner. Of the others 4 and the reference corner.
  Row side[kBoxCandidates];
  Row set;        ///< of candidates that are near enough, or the four of them to keep: sum of 2^c
  Row inside;     ///< how far the one farthest inside is from leaving
  Row steepness;  ///< what a separation changes by at most as features slide, m / m: corners of the
                  ///< reference face over the incident plane, and its edges over the sides
};

/// Signs of a quadrilateral's corners along e and f, and x and y, in order.
inline constexpr double kSignX[4] = {1, -1, -1, 1};
inline constexpr double kSignY[4] = {1, 1, -1, -1};

/// Each works on the first `pairs` lanes at least.
struct BoxKernels {
  int lanes;
  void (*separate)(BoxPairBlock&, int pairs);
  void (*clip)(BoxFaceBlock&, int pairs);
};

extern const BoxKernels kBoxKernels1, kBoxKernels2;
#ifdef CRADLE_WIDE_X86
extern const BoxKernels kBoxKernels4;  ///< needs AVX2
extern const BoxKernels kBoxKernels8;  ///< needs AVX-512 F, VL, DQ
#endif

}  // namespace cradle
