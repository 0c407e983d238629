/// In which direction of their own two shapes leave each other best: their faces and sides. Private
/// to this folder.
#pragma once

#include <optional>

#include "server/collision/convex_pair.h"

namespace cradle {

struct Direction {  // in A
  Vector n = Vector::Zero();
  double overlap = std::numeric_limits<double>::infinity();
};

/// A direction in which one shape has a flat face, and what reaches deepest behind it.
struct FaceDirection : Direction {
  enum class Of { nothing, A, B } face_of = Of::nothing;
  std::int32_t face = 0;            ///< of a hull its number
  Vector deepest = Vector::Zero();  ///< point of the other shape, in A
};

/// The face, side or other likely direction with the least overlap; of two hulls all their faces
/// are compared, up to 256 each.
FaceDirection best_face(const ConvexPair& pair, SupportHints& hints);

/// Of each shape the flat face nearest to the other's centre; of a hull those at the corner that
/// the hints name. No overlap: there is none.
FaceDirection likely_face(const ConvexPair& pair, SupportHints& hints);

/// m, how far inside the sides of its face what reaches deepest behind it is.
double inside_face(const ConvexPair& pair, const FaceDirection& face);

/// `found`, where what is deepest meets a face, with its lead; nothing if it is not certainly best.
std::optional<LeastOverlap> certain_at_face(const ConvexPair& pair, LeastOverlap found,
                                            FaceDirection::Of face_of, double lead_wanted);

/// Whether the cores certainly overlap, and in that direction least; and, where neither is flat, do
/// so until both have moved by `slack` (m) together.
bool is_best(const ConvexPair& pair, const FaceDirection& face, double slack = 0);

}  // namespace cradle
