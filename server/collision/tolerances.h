/// Every tolerance of the narrow phase, with its unit, its reason, and the test that pins it.
#pragma once

namespace cradle {

/// Lengths marked "scaled" hold for boxes of half extent `nominal_half_extent_m` and larger; for a
/// thinner box they shrink with its smallest half extent, so that a matchbox behaves like a crate.
struct CollisionTolerances {
  /// m. Nearer than this, a direction is rounding noise of world coordinates, and a fixed one is
  /// taken. Test: "two spheres with one centre get a fixed normal".
  double coincident_m = 1e-12;

  /// Squared sine of the angle between two capsules. Below it (0.6 degrees) their ends count, too:
  /// where the lines are nearest is badly determined. Test: "capsules: side by side two points,
  /// crossed one, ends on the true distance".
  double parallel_sine2 = 1e-4;

  /// Squared sine of the angle between two edges of boxes. Below it their common normal is known to
  /// 1e-10 only, and a face parts nearly as well: by a millionth of their length. Test:
  /// "rods that cross at a small angle meet where their edges do".
  double crossing_sine2 = 1e-12;

  /// m. Test: "a matchbox behaves like a crate".
  double nominal_half_extent_m = 0.5;

  /// m, scaled. B's face must part the boxes better by this much to be the reference: else two
  /// equal cubes would swap roles in every tick, and with them the names of their points.
  /// Test: "the reference face stays with A in a tie".
  double reference_bias_m = 1e-3;

  /// m, scaled. An edge axis must part the boxes better than any face by this much ...
  double edge_bias_m = 1e-2;
  /// ... and by this fraction of the overlap: in deep overlap one edge point turns the boxes
  /// instead of parting them. Without it piles showed overlaps of 0.76 m, with it 0.15 m.
  /// Test of both: "an edge contact needs a clear lead over the faces".
  double edge_bias_per_depth = 0.25;

  /// m, scaled. A corner this far outside the reference face counts as above it, so that the
  /// points of a swaying, flush stack keep their names. And a face still counts where the other box
  /// reaches this much deeper beside it than over it, and where edges part the boxes but they
  /// overlap along its normal by less. Test: "a flush stack keeps its features while it sways",
  /// "heaps of cubes come to rest".
  double clip_slack_m = 1e-3;

  /// Cosine of the angle to the normal up to which faces beside an edge or corner that touches are
  /// foreseen to meet (26 degrees): without it boxes in a heap that falls in turned into each other
  /// by 0.3 m in a tick, 0.09 m in the mean, with it by half of that.
  double facing_cosine = 0.9;
  /// m, scaled. What is nearer than this to the point that touches says nothing new. Test of both:
  /// "faces that are about to slam together are foreseen".
  double same_place_m = 0.1;

  /// Of the slack, and of the face that meets: the four points that stood for it last time do so
  /// again while none is deeper than they are by more than this, and they reach so far. Test:
  /// "heaps of cubes come to rest".
  double last_four_depth = 0.5, last_four_spread = 0.8;
  /// Of the slack. Points with a gap larger than that of the deepest by more than this carry
  /// nothing: when four of more are chosen they count so much less. Same test.
  double carrying_gap = 0.01, gap_weight = 0.01;

  /// Of the slack. What overlaps most may be beside the points that stand for it: the deepest of
  /// them stands for all of that, others for the less, the higher they are, up to this. With four
  /// times as much heaps of 2000 come to rest sooner, and gain a tenth more energy from overlaps as
  /// they fall. Test: "a point's separation does not jump where another becomes the deepest".
  double as_deep = 0.25;

  /// m. When four of more points are chosen, depths and distances closer than this count as equal,
  /// so that rounding does not choose. Test: "rounding does not choose among eight points".
  double tie_m = 1e-9;

  /// Of any two convex shapes. A direction this near to the normal of a face, or of two edges, is
  /// taken for it (it must overlap no more). Test: "faces that meet give their exact normal".
  double sharpen_sine = 1e-4;

  /// A face that looks along the normal, and an edge that lies across it, to this cosine (0.8
  /// degrees) is what touches; what is more oblique touches with its edge or corner, unless it
  /// meets such a face. Test: "a small motion changes the manifold little".
  double flush_cosine = 0.9999;

  /// m, scaled. A contact that misses the exact separation by less gets it; else the point where
  /// the closest points were is added. Test: "the deepest separation is the overlap".
  double witness_m = 1e-6;

  /// Of the smaller body's reach, at most of 1 m. A manifold is made anew when its bodies have
  /// moved by more: by then its points have wandered by as much over the faces.
  double kept_motion = 1e-4;
  /// m. Where an oblique edge crosses a side, or an oblique face is over a corner, a separation
  /// changes by more than its bodies move. While both move by half a manifold's lead, by half of
  /// this at most. Test: "kept manifolds are as good as fresh ones at default settings".
  double kept_slide_m = 1e-4;
  /// m. A margin that has grown by less asks for no new manifold: the points that would come are
  /// that far from touching. Test of these two: "kept manifolds are as good as fresh ones".
  double kept_margin_m = 1e-3;

  /// Sine of the angle between two faces of a hull up to which they carry as one (0.0006 degrees):
  /// noise of the corners bends a face by less. Test: "a hull of noisy corners carries".
  double level_sine = 1e-5;

  /// Of a hull's length. Points that are outside of all others by less are no corners of it: the
  /// edges between such would point anywhere. Test: "corners that are one but for rounding are
  /// one".
  double corner_by_length = 2.5e-10;

  /// Sine of the angle between two triangles of a surface up to which their edge is flat (0.006
  /// degrees): digits of typed coordinates bend a plane by less, and a ball of the most triangles
  /// that a mesh may have bends more. Test: "a body slides over a flat mesh without a bump".
  double flat_sine = 1e-4;

  /// Cosine of the angle between two normals of a surface up to which their contacts are one
  /// manifold (0.6 degrees). Test: "neighbours that are nearly in one plane make one manifold".
  double one_manifold_cosine = 0.99995;

  /// A normal may leave the wedge between the normals of the two triangles at an edge, or the cone
  /// at a vertex, by this sine. Test: "a mesh of a cube behaves as the cube".
  double wedge_sine = 1e-3;

  /// m, per metre of the coordinates. A point so far outside a triangle is over it, so that no seam
  /// between two lets one through. Test: "a body slides over a flat mesh without a bump".
  double seam = 1e-9;
};

inline constexpr CollisionTolerances kTolerances;

}  // namespace cradle
