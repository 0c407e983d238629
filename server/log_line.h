/// One line of the log, as text or as a JSON object.
///
/// Names of clients and bodies come from the network: whatever bytes they hold, a line is one line,
/// valid UTF-8, and has nothing that a terminal would obey.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>

namespace cradle {

enum class LogFormat { text, json };

/// A value that belongs to a line. What the string view shows must outlive the call it is given to.
struct LogField {
  std::string_view key;  ///< constant: letters, digits and '_'; not time, level, message
  std::variant<std::string_view, std::int64_t, double> value;
};

/// `text` without what a terminal would obey, as in a line of text.
std::string printable(std::string_view text);

/// `level` is a constant word. Without the end of the line.
///  - text: `2026-01-31T12:00:00.000Z info client said hello name="ann"`. Bytes that are not UTF-8
///  and
///    control characters, those of writing direction included, stand as \xNN or \u{NNNN}.
///  - JSON: time, level, message and the fields, strings escaped; bytes that are not UTF-8 become
///  U+FFFD,
///    numbers that are none become null.
std::string log_line(LogFormat format, std::int64_t utc_ms, std::string_view level,
                     std::string_view message, std::span<const LogField> fields);

}  // namespace cradle
