#include "protocol/transport/recording.h"

#include <cradle/limits.h>

#include <algorithm>
#include <charconv>
#include <system_error>
#include <utility>

namespace cradle {
namespace {

using std::chrono::microseconds;

constexpr std::string_view kRecordingScheme = "file://";
constexpr double kSpeedMin = 1e-3, kSpeedMax = 1e3;
constexpr std::size_t kOtherWorldsKept = 8;

/// Turns %XX into bytes; nothing if a % is followed by something else, or nothing is left.
std::optional<std::string> path_of(std::string_view text) {
  std::string path;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      path += text[i];
      continue;
    }
    const std::string_view digits = text.substr(i + 1, 2);
    int byte = 0;
    const auto [end, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), byte, 16);
    if (digits.size() < 2 || error != std::errc{} || end != digits.data() + 2 || byte <= 0) {
      return std::nullopt;
    }
    path += static_cast<char>(byte);
    i += 2;
  }
  return path.empty() ? std::nullopt : std::optional(path);
}

std::string quoted(const std::string& path) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  for (const char c : path) {
    if (c == '%' || c == '?' || c == '&') {
      const auto byte = static_cast<unsigned char>(c);
      text += {'%', kDigits[byte / 16], kDigits[byte % 16]};
    } else {
      text += c;
    }
  }
  return text;
}

bool set_url_option(RecordingUrl& url, std::string_view option) {
  constexpr std::string_view kSpeed = "speed=", kStates = "states=";
  if (option.starts_with(kSpeed)) {
    option.remove_prefix(kSpeed.size());
    const auto [end, error] =
        std::from_chars(option.data(), option.data() + option.size(), url.speed);
    return error == std::errc{} && end == option.data() + option.size() &&
           (url.speed == 0 || url.speed >= kSpeedMin) && url.speed <= kSpeedMax;
  }
  if (!option.starts_with(kStates)) return false;
  const auto path = path_of(option.substr(kStates.size()));
  url.states_path = path.value_or("");
  return path.has_value();
}

}  // namespace

bool is_recording_url(std::string_view text) { return text.starts_with(kRecordingScheme); }

std::string RecordingUrl::text() const {
  char speed_text[32];
  const auto end = std::to_chars(speed_text, speed_text + sizeof speed_text, speed).ptr;
  std::string all =
      std::string(kRecordingScheme) + quoted(path) + "?speed=" + std::string(speed_text, end);
  return states_path.empty() ? all : all + "&states=" + quoted(states_path);
}

std::optional<RecordingUrl> parse_recording_url(std::string_view text) {
  if (!is_recording_url(text)) return std::nullopt;
  text.remove_prefix(kRecordingScheme.size());
  const auto mark = std::min(text.find('?'), text.size());
  const auto path = path_of(text.substr(0, mark));
  if (!path) return std::nullopt;
  RecordingUrl url;
  url.path = *path;
  text.remove_prefix(mark);
  while (!text.empty()) {  // at a ? or &
    text.remove_prefix(1);
    const auto end = std::min(text.find('&'), text.size());
    if (!set_url_option(url, text.substr(0, end))) return std::nullopt;
    text.remove_prefix(end);
  }
  return url;
}

Recording::Recording(const RecordingUrl& url, std::string_view world, Time now)
    : channels_(world), speed_(url.speed), begun_at_(now), time_(now), next_at_(now) {
  for (const std::string& path : {url.path, url.states_path}) {
    if (path.empty()) continue;
    try {
      files_.push_back({EventLogReader(path), {}});
    } catch (const std::system_error& error) {
      throw std::system_error(error.code(), path);
    }
    files_.back().next = files_.back().reader.next();
  }
  read_next();
  next_at_ = now;
}

/// The oldest of the files' next messages, of any kind.
std::optional<LoggedMessage> Recording::read() {
  File* oldest = nullptr;
  for (File& file : files_) {
    if (file.next && (!oldest || file.next->time_us < oldest->next->time_us)) oldest = &file;
  }
  if (!oldest) return std::nullopt;
  ++messages_read_;
  return std::exchange(oldest->next, oldest->reader.next());
}

/// Goes on to the next message of our world's server. The file's clock may be set, or its times
/// made up: only steps forward count, and none above kLongestPause.
void Recording::read_next() {
  constexpr std::string_view kBefore = "CRADLE_", kAfter = "_STATUS";
  const std::int64_t before_us = next_ ? next_->time_us : 0;
  for (next_ = read(); next_; next_ = read()) {
    const auto kind = channels_.kind(next_->channel);
    if (kind && !is_command(*kind) && kind != MessageKind::receipts) break;
    std::string_view other = next_->channel;
    if (kind || !other.starts_with(kBefore) || !other.ends_with(kAfter)) continue;
    if (other_worlds_.size() >= kOtherWorldsKept || other.size() < kBefore.size() + kAfter.size()) {
      continue;
    }
    other = other.substr(kBefore.size(), other.size() - kBefore.size() - kAfter.size());
    if (is_world_name(other)) other_worlds_.emplace(other);
  }
  if (!next_) return;
  next_->time_us = std::clamp<std::int64_t>(next_->time_us, 0, limits::kIntegerMax);
  next_at_ += std::clamp(microseconds(next_->time_us - before_us), microseconds(0), kLongestPause);
}

Recording::Time Recording::play(Time now) {
  if (!next_) return time_;
  if (speed_ == 0) {
    time_ = next_at_;
  } else {
    const auto passed = std::chrono::duration<double>(now - begun_at_) * speed_;
    time_ = begun_at_ + std::chrono::duration_cast<Time::duration>(passed);
  }
  return time_;
}

microseconds Recording::until_next(Time now) const {
  if (!next_) return microseconds::max();
  if (speed_ == 0) return microseconds(0);
  const auto real = std::chrono::duration<double>(next_at_ - begun_at_) / speed_;
  const auto left = std::chrono::ceil<microseconds>(real - (now - begun_at_));
  return std::max(left, microseconds(0));
}

bool Recording::send(std::string_view, ByteView) {
  ++stats_.send_failures;
  return false;
}

int Recording::receive(microseconds, const Sink& sink) {
  int count = 0;
  while (next_ && next_at_ <= time_) {
    const LoggedMessage message = *next_;
    read_next();
    ++stats_.received;
    ++count;
    sink(message.channel, message.payload);
    if (speed_ == 0) break;
  }
  return count;
}

TransportStats Recording::stats() const {
  TransportStats stats = stats_;
  for (const File& file : files_) stats.count(DatagramFault::bad_magic, file.reader.damages());
  return stats;
}

}  // namespace cradle
