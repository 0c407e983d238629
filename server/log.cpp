#include "server/log.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <climits>
#include <mutex>

namespace cradle {
namespace {

std::atomic<std::int64_t> lines_lost = 0;

/// The fields of the line that this thread is writing: spdlog has no place for them, and formats
/// before it returns.
thread_local std::span<const LogField> fields_of_line;

/// Standard error, never waited for. Its flags are shared with other processes and are left alone:
/// a pipe or terminal is opened once more for ourselves.
class ErrorStream {
 public:
  ErrorStream() {
    struct stat status {};
    if (::fstat(STDERR_FILENO, &status) != 0) return;
    is_socket_ = S_ISSOCK(status.st_mode);
    if (S_ISFIFO(status.st_mode) || S_ISCHR(status.st_mode)) {
      own_ = ::open("/proc/self/fd/2", O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    }
  }
  ~ErrorStream() {
    if (own_ >= 0) ::close(own_);
  }
  ErrorStream(const ErrorStream&) = delete;
  ErrorStream& operator=(const ErrorStream&) = delete;

  /// False if nothing of the line was taken. What is taken in part is finished before the next one.
  bool write(std::string_view line) {
    rest_.erase(0, write_some(rest_));
    if (!rest_.empty()) return false;
    const std::size_t taken = write_some(line);
    if (taken == 0) return false;
    rest_ = line.substr(taken);
    return true;
  }

 private:
  std::size_t write_some(std::string_view text) const {
    std::size_t taken = 0;
    while (taken < text.size()) {
      const ssize_t count = write_once(text.substr(taken));
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) break;
      taken += static_cast<std::size_t>(count);
    }
    return taken;
  }

  ssize_t write_once(std::string_view text) const {
    if (own_ >= 0) return ::write(own_, text.data(), text.size());
    if (is_socket_) {
      return ::send(STDERR_FILENO, text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    }
    // A pipe that polls as writable has room for PIPE_BUF bytes.
    pollfd room{STDERR_FILENO, POLLOUT, 0};
    if (::poll(&room, 1, 0) != 1) return 0;
    return ::write(STDERR_FILENO, text.data(), std::min<std::size_t>(text.size(), PIPE_BUF));
  }

  int own_ = -1;
  bool is_socket_ = false;
  std::string rest_;
};

class Sink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit Sink(LogFormat format) : format_(format) {}

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::int64_t utc_ms =
        std::chrono::duration_cast<std::chrono::milliseconds>(message.time.time_since_epoch())
            .count();
    const auto level = spdlog::level::to_string_view(message.level);
    const std::string line =
        log_line(format_, utc_ms, {level.data(), level.size()},
                 {message.payload.data(), message.payload.size()}, fields_of_line);
    if (untold_ > 0) {
      const LogField count[] = {{"count", untold_}};
      if (stream_.write(log_line(format_, utc_ms, "warning",
                                 "log lines lost: standard error took no more", count) +
                        '\n')) {
        untold_ = 0;
      }
    }
    if (untold_ > 0 || !stream_.write(line + '\n')) {
      ++untold_;
      ++lines_lost;
    }
  }
  void flush_() override {}

  LogFormat format_;
  ErrorStream stream_;
  std::int64_t untold_ = 0;  ///< lines lost since it was last told
};

spdlog::level::level_enum level_of(LogLevel level) {
  switch (level) {
    case LogLevel::info:
      return spdlog::level::info;
    case LogLevel::warn:
      return spdlog::level::warn;
    case LogLevel::error:
      break;
  }
  return spdlog::level::err;
}

}  // namespace

void set_up_log(const std::string& level, LogFormat format) {
  ::signal(SIGPIPE, SIG_IGN);
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("cradled", std::make_shared<Sink>(format)));
  set_log_level(level);
}

void set_log_level(const std::string& level) { spdlog::set_level(spdlog::level::from_str(level)); }

void write_log(LogLevel level, std::string_view message, std::span<const LogField> fields) {
  fields_of_line = fields;
  spdlog::log(level_of(level), spdlog::string_view_t(message.data(), message.size()));
  fields_of_line = {};
}

std::int64_t log_lines_lost() { return lines_lost; }

}  // namespace cradle
