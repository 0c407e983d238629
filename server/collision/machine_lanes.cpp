#include "server/collision/machine_lanes.h"

namespace cradle {
namespace {

std::vector<int> found_lanes() {
  std::vector<int> lanes{1, 2};
#ifdef CRADLE_WIDE_X86
  if (__builtin_cpu_supports("avx2")) lanes.push_back(4);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq")) {
    lanes.push_back(8);
  }
#endif
  return lanes;
}

}  // namespace

const std::vector<int>& machine_lanes() {
  static const std::vector<int> kFound = found_lanes();
  return kFound;
}

}  // namespace cradle
