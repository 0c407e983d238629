/// Single fields of messages <-> values. Private to the files that convert messages.
#pragma once

#include <cradle/limits.h>
#include <cradle/types.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>

namespace cradle {

inline void put(const Vec3& v, double (&out)[3]) {
  out[0] = v.x;
  out[1] = v.y;
  out[2] = v.z;
}
inline void put(const Quat& q, double (&out)[4]) {
  out[0] = q.w;
  out[1] = q.x;
  out[2] = q.y;
  out[3] = q.z;
}
inline void put(const std::string& name, std::uint8_t (&out)[32]) {
  std::memset(out, 0, sizeof out);
  std::memcpy(out, name.data(), std::min<std::size_t>(name.size(), limits::kNameBytes));
}

inline Vec3 vector(const double (&in)[3]) { return {in[0], in[1], in[2]}; }
inline Quat rotation(const double (&in)[4]) { return {in[0], in[1], in[2], in[3]}; }

inline bool get(const std::uint8_t (&in)[32], std::string& name) {
  const auto* const end = std::find(std::begin(in), std::end(in), std::uint8_t{0});
  if (end == std::end(in)) return false;
  name.assign(std::begin(in), end);
  return std::all_of(end, std::end(in), [](std::uint8_t byte) { return byte == 0; });
}

/// Enumerators are numbered from 0; `last` is the largest.
template <class Enum>
bool get(std::int32_t in, Enum last, Enum& out) {
  if (in < 0 || in > static_cast<std::int32_t>(last)) return false;
  out = static_cast<Enum>(in);
  return true;
}

inline bool is_integer(std::int64_t value, std::int64_t lowest = 0) {
  return value >= lowest && value <= limits::kIntegerMax;
}

}  // namespace cradle
