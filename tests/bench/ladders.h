/// Ladders of scenes that show where a method ends: higher stacks, heavier loads.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "tests/bench/side_by_side.h"

namespace cradle::bench {

/// One rung: A7 with so many cubes, or A8a and A8b with so heavy a cube on top.
struct Rung {
  const Case* which = nullptr;
  int number = 0;  ///< cubes, or kilogrammes
  Scene scene;
};

/// Rung by rung, ladder after ladder.
std::vector<Rung> ladder_rungs();

/// Cubes that moved by less than half their width stand.
bool stands(const Row& row);

/// A line a rung: of every engine its error, whether it stands, the largest penetration, and time.
std::string ladders_header(Format format, std::span<const PeerLibrary> libraries);
std::string ladders_line(Format format, const Rung& rung, const SideBySide& result);

}  // namespace cradle::bench
