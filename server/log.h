/// The log of `cradled serve`, on standard error. Any thread.
///
/// Writing never waits: what standard error does not take at once (a full pipe, a stopped terminal)
/// is lost, counted, and told of in the log as soon as there is room again. Only a file is written
/// to as the disk takes it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "server/log_line.h"

namespace cradle {

enum class LogLevel { info, warn, error };

/// `level`: trace, debug, info, warn, error or off. Lines go to the process's one log, that of
/// spdlog, from now on. From now on the process ignores SIGPIPE, too: who reads the log may go
/// away.
void set_up_log(const std::string& level, LogFormat format);

void set_log_level(const std::string& level);

/// `message` is constant text; what varies goes into the fields.
void write_log(LogLevel level, std::string_view message, std::span<const LogField> fields);
inline void write_log(LogLevel level, std::string_view message,
                      std::initializer_list<LogField> fields = {}) {
  write_log(level, message, std::span(fields.begin(), fields.size()));
}

/// Lines that standard error did not take, since the start.
std::int64_t log_lines_lost();

}  // namespace cradle
