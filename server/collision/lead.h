/// How far two cores may move until their direction of least overlap is another one. Private to
/// this folder.
///
/// Lengths in m, of the motion of both together (kept_manifold.h).
#pragma once

#include <span>

#include "server/collision/convex_pair.h"

namespace cradle {

/// What a direction bears where the cores are apart: it turns by the motion over the distance.
double lead_by_turn(double distance);

/// Of cores with corners only, by the closest points: toward the inside of a face of M it turns
/// with the bodies alone until the foot has left the face.
double lead_of_closest(const Simplex& simplex, double distance);

/// Directions as near to each other as this are one: a cosine.
inline constexpr double kOneDirection = 0.999998;  // 2e-3 rad

/// How fast the direction across a face of M turns, beside its bodies: the sine of the angle
/// between the two edges that make it; 1 where it is a face of one body.
double edge_sine(std::span<const Difference> corners);

}  // namespace cradle
