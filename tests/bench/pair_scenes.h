/// Pairs of shapes in seeded poses, a few hundred alike, for the narrow phase by itself.
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "tests/bench/solids.h"

namespace cradle::bench {

inline constexpr double kPairMargin = 0.02;  ///< m, of all pairs here

/// Shapes of about a metre, in the order of the table.
enum class PairShape {
  sphere,
  box,
  capsule,
  cylinder,
  cone,
  ellipsoid,
  hull_8,   ///< the corners of a box
  hull_12,  ///< a regular icosahedron
  hull_42,  ///< points on an ellipsoid
  half_space
};
inline constexpr int kPairShapes = 10;

std::string_view word_of(PairShape shape);

enum class Situation {
  resting,  ///< flush on a face or lying on a side, up to 1 mm deep
  angle,    ///< turned at random, up to 1 cm deep
  deep,     ///< turned at random, 10 to 50 % of the thinner shape's half width along the line on
            ///< which they touched first; none that has left on the other side
  apart,    ///< turned at random, within the margin
};
inline constexpr std::array kSituations = {Situation::resting, Situation::angle, Situation::deep,
                                           Situation::apart};

std::string_view word_of(Situation situation);

/// A and B in `count` poses; the same for the same arguments.
std::vector<Pair> pairs_in(PairShape A, PairShape B, Situation situation, std::size_t count);

}  // namespace cradle::bench
