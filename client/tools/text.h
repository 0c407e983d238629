/// Text for terminals.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>

namespace cradle::tool {

/// As snprintf, of any length.
template <class... Args>
std::string format(const char* pattern, Args... args) {
  const int size = std::snprintf(nullptr, 0, pattern, args...);
  std::string text(static_cast<std::size_t>(size), '\0');
  std::snprintf(text.data(), text.size() + 1, pattern, args...);
  return text;
}

/// For %lld.
inline long long wide(std::int64_t number) { return number; }

/// What a terminal can show.
struct Style {
  bool has_colour = false;
  bool has_utf8 = false;
  int columns = 80;
  int rows = 24;

  std::string bold(const std::string& text) const { return paint("1", text); }
  std::string dim(const std::string& text) const { return paint("2", text); }

 private:
  std::string paint(const char* code, const std::string& text) const {
    return has_colour ? std::string("\x1b[") + code + "m" + text + "\x1b[0m" : text;
  }
};

}  // namespace cradle::tool
