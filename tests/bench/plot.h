/// What both reports draw with.
#pragma once

#include <array>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace cradle::bench {

/// gnuplot is missing, or failed.
class PlotError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Runs gnuplot on NAME.gp, in the folder. Throws PlotError.
void plot(const std::filesystem::path& folder, const std::string& name);

/// Throws OutputError of server/trace.h.
void write_file(const std::filesystem::path& path, const std::string& text);

/// As printf does, up to 255 characters.
template <class... Values>
std::string formatted(const char* format, Values... values) {
  std::array<char, 256> text;
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

}  // namespace cradle::bench
