#include "server/log_line.h"

#include <array>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <ctime>

namespace cradle {
namespace {

/// What a text begins with: a character and its bytes, or one byte that is no UTF-8.
struct Character {
  char32_t code = 0;
  std::string_view bytes;
  bool is_valid = false;
};

Character first_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  const std::size_t length = lead < 0x80   ? 1
                             : lead < 0xC2 ? 0
                             : lead < 0xE0 ? 2
                             : lead < 0xF0 ? 3
                             : lead < 0xF5 ? 4
                                           : 0;
  const Character invalid{lead, text.substr(0, 1), false};
  if (length == 0 || length > text.size()) return invalid;
  char32_t code = length == 1 ? lead : lead & (0x7Fu >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return invalid;
    code = code << 6 | (byte(i) & 0x3Fu);
  }
  // Shorter forms exist, halves of surrogates, beyond the last character.
  const bool is_wrong = (length == 3 && code < 0x800) || (length == 4 && code < 0x10000) ||
                        (code >= 0xD800 && code <= 0xDFFF) || code > 0x10FFFF;
  return is_wrong ? invalid : Character{code, text.substr(0, length), true};
}

/// Characters that change the line, the terminal or the direction of writing.
bool is_control(char32_t c) {
  return c < 0x20 || (c >= 0x7F && c < 0xA0) || c == 0x061C || c == 0x200E || c == 0x200F ||
         (c >= 0x2028 && c <= 0x202E) || (c >= 0x2066 && c <= 0x2069) || c == 0xFEFF;
}

void append_formatted(std::string& line, const char* format, unsigned value) {
  std::array<char, 16> digits{};
  std::snprintf(digits.data(), digits.size(), format, value);
  line += digits.data();
}

/// `quotes`: also what would end or change a quoted text.
void append_escaped(std::string& line, LogFormat format, std::string_view text, bool quotes) {
  while (!text.empty()) {
    const Character c = first_character(text);
    text.remove_prefix(c.bytes.size());
    if (format == LogFormat::json) {
      if (!c.is_valid) {
        line += "\\ufffd";
      } else if (is_control(c.code)) {
        append_formatted(line, "\\u%04x", c.code);
      } else {
        if (c.code == '"' || c.code == '\\') line += '\\';
        line += c.bytes;
      }
    } else if (!c.is_valid || c.code < 0x20 || c.code == 0x7F) {
      append_formatted(line, "\\x%02x", c.code);
    } else if (is_control(c.code)) {
      append_formatted(line, "\\u{%04x}", c.code);
    } else {
      if (quotes && (c.code == '"' || c.code == '\\')) line += '\\';
      line += c.bytes;
    }
  }
}

void append_number(std::string& line, auto number) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number);
  line.append(digits.data(), end.ptr);
}

void append_value(std::string& line, LogFormat format, const LogField& field) {
  if (const auto* text = std::get_if<std::string_view>(&field.value)) {
    line += '"';
    append_escaped(line, format, *text, true);
    line += '"';
  } else if (const auto* integer = std::get_if<std::int64_t>(&field.value)) {
    append_number(line, *integer);
  } else if (const double number = std::get<double>(field.value);
             format == LogFormat::json && !std::isfinite(number)) {
    line += "null";
  } else {
    append_number(line, number);
  }
}

void append_time(std::string& line, std::int64_t utc_ms) {
  const std::time_t seconds = utc_ms / 1000;
  std::tm parts{};
  ::gmtime_r(&seconds, &parts);
  std::array<char, 32> text{};
  line.append(text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S.", &parts));
  append_formatted(line, "%03uZ", static_cast<unsigned>(utc_ms % 1000));
}

}  // namespace

std::string log_line(LogFormat format, std::int64_t utc_ms, std::string_view level,
                     std::string_view message, std::span<const LogField> fields) {
  const bool is_json = format == LogFormat::json;
  std::string line = is_json ? R"({"time":")" : "";
  append_time(line, utc_ms);
  line += is_json ? R"(","level":")" : " ";
  line += level;
  line += is_json ? R"(","message":")" : " ";
  append_escaped(line, format, message, false);
  if (is_json) line += '"';
  for (const LogField& field : fields) {
    assert(field.key != "time" && field.key != "level" && field.key != "message");
    line += is_json ? ",\"" : " ";
    line += field.key;
    line += is_json ? "\":" : "=";
    append_value(line, format, field);
  }
  if (is_json) line += '}';
  return line;
}

std::string printable(std::string_view text) {
  std::string line;
  append_escaped(line, LogFormat::text, text, false);
  return line;
}

}  // namespace cradle
