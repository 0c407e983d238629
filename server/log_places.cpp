#include "server/log_places.h"

#include <string>
#include <utility>

namespace cradle {

LogPlaces::LogPlaces(Write write) : write_(std::move(write)) {}

void LogPlaces::tell_due(std::int64_t now_us) {
  for (LogPlace* place : places_) {
    if (place->is_over(now_us)) place->tell();
  }
}

void LogPlaces::tell_all() {
  for (LogPlace* place : places_) place->tell();
}

LogPlace::LogPlace(LogPlaces& places, LogLevel level, std::string_view message)
    : places_(places), level_(level), message_(message) {
  places.places_.push_back(this);
}

void LogPlace::write(std::int64_t now_us, std::initializer_list<LogField> fields) {
  if (is_over(now_us)) tell();
  if (written_ == LogPlaces::kLines) {
    ++left_out_;
    ++places_.left_out_;
    return;
  }
  if (written_ == 0) begin_us_ = now_us;
  ++written_;
  places_.write_(level_, message_, {fields.begin(), fields.size()});
}

bool LogPlace::is_over(std::int64_t now_us) const {
  return now_us - begin_us_ >= LogPlaces::kInterval_us;
}

/// Ends the interval.
void LogPlace::tell() {
  if (left_out_ > 0) {
    const LogField like[] = {{"like", message_}};
    places_.write_(level_, std::to_string(left_out_) + " more like this", like);
  }
  written_ = 0;
  left_out_ = 0;
}

}  // namespace cradle
