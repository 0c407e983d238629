/// Keeps the log readable when a client or the physics repeats itself: each place that can do so
/// writes ten lines in ten seconds, counts what is beyond that, and tells "N more like this" when
/// the ten seconds are over. Places do not share their ten lines.
///
/// No clock: time is what the caller says it is. One thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <string_view>
#include <vector>

#include "server/log.h"

namespace cradle {

class LogPlace;

/// All places of one owner.
class LogPlaces {
 public:
  static constexpr int kLines = 10;
  static constexpr std::int64_t kInterval_us = 10'000'000;

  using Write = std::function<void(LogLevel, std::string_view, std::span<const LogField>)>;
  explicit LogPlaces(Write write = [](LogLevel level, std::string_view message,
                                      std::span<const LogField> fields) {
    write_log(level, message, fields);
  });

  /// Tells of what was left out in the intervals that are over. Now and then, and while it is
  /// quiet.
  void tell_due(std::int64_t now_us);
  /// Tells of everything that was left out: at the end.
  void tell_all();

  /// Lines left out since the start, told of or not.
  std::int64_t left_out() const { return left_out_; }

 private:
  friend class LogPlace;
  Write write_;
  std::vector<LogPlace*> places_;
  std::int64_t left_out_ = 0;
};

/// One statement in the code.
class LogPlace {
 public:
  /// `message` is constant. `places` outlives the place.
  LogPlace(LogPlaces& places, LogLevel level, std::string_view message);
  LogPlace(const LogPlace&) = delete;
  LogPlace& operator=(const LogPlace&) = delete;

  /// `now_us`: a monotonic time, us.
  void write(std::int64_t now_us, std::initializer_list<LogField> fields);

 private:
  friend class LogPlaces;
  bool is_over(std::int64_t now_us) const;
  void tell();

  LogPlaces& places_;
  LogLevel level_;
  std::string_view message_;
  std::int64_t begin_us_ = 0;  ///< of the interval
  int written_ = 0;            ///< in the interval; 0: there is none
  std::int64_t left_out_ = 0;
};

}  // namespace cradle
