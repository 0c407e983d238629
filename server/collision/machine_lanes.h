/// How many doubles this machine can work on side by side.
#pragma once

#include <cassert>
#include <initializer_list>
#include <vector>

namespace cradle {

/// The widths that kernels are compiled for and this machine can run, ascending: 1, 2, and, of 4
/// (AVX2) and 8 (AVX-512 F, VL and DQ), what it has.
const std::vector<int>& machine_lanes();

/// Of kernels of all widths, ascending, those of so many lanes, one of machine_lanes(); or 0: the
/// most.
template <class Kernels>
const Kernels& kernels_of_width(int lanes, std::initializer_list<const Kernels*> all) {
  if (lanes == 0) lanes = machine_lanes().back();
  assert(lanes <= machine_lanes().back() && "lanes are one of machine_lanes()");
  for (const Kernels* kernels : all) {
    if (kernels->lanes == lanes) return *kernels;
  }
  assert(false && "lanes are one of machine_lanes()");
  return **all.begin();
}

}  // namespace cradle
