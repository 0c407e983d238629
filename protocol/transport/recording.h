/// A transport whose port is a file that lcm-logger wrote: what a world said, at the pace it said
/// it. It only receives. Like all that must be tested, it has no clock of its own.
#pragma once

#include <set>

#include "protocol/transport/event_log.h"
#include "protocol/transport/transport.h"

namespace cradle {

/// `file://PATH?speed=X&states=PATH`: the recording of the control port, of both, or of the states
/// alone, and if it is one more file, that of the state port. In paths, %XX is the byte XX.
struct RecordingUrl {
  std::string path;
  std::string states_path;  ///< empty: none
  double speed = 1;         ///< over real time; 0: a message whenever asked for one

  std::string text() const;
};

/// Nothing if `text` is not file:// with a path, and at most one more path and a speed of 0 or
/// 0.001 .. 1000.
std::optional<RecordingUrl> parse_recording_url(std::string_view text);
bool is_recording_url(std::string_view text);  ///< begins with file://

class Recording final : public Transport {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// Status, events and states of `world`, which must satisfy is_world_name(). Recorded time begins
  /// at `now` with the first of them. Throws std::system_error, with the path, where a file cannot
  /// be read.
  Recording(const RecordingUrl& url, std::string_view world, Time now);

  /// Plays on until `now`; how late it is in recorded time, which passes `speed` times as fast and
  /// stands still at the end. Pauses of the recording are at most kLongestPause.
  Time play(Time now);
  Time time() const { return time_; }

  /// Until the next message; zero if it is due.
  std::chrono::microseconds until_next(Time now) const;
  bool has_ended() const { return !next_; }

  /// Worlds heard that are not ours.
  const std::set<std::string>& other_worlds() const { return other_worlds_; }
  std::int64_t messages_read() const { return messages_read_; }  ///< of any kind

  /// False, and counted: a recording takes no messages.
  bool send(std::string_view channel, ByteView payload) override;
  /// Hands on what is due, without waiting; at speed 0 one message.
  int receive(std::chrono::microseconds timeout, const Sink& sink) override;
  /// `rejected()` counts the damaged stretches of the files.
  TransportStats stats() const override;

  static constexpr std::chrono::microseconds kLongestPause{5'000'000};

 private:
  struct File {
    EventLogReader reader;
    std::optional<LoggedMessage> next;
  };

  std::optional<LoggedMessage> read();
  void read_next();

  Channels channels_;
  double speed_;
  std::vector<File> files_;
  Time begun_at_;  ///< wall time and recorded time are equal here
  Time time_;
  std::optional<LoggedMessage> next_;
  Time next_at_;  ///< recorded time of `next_`
  std::set<std::string> other_worlds_;
  std::int64_t messages_read_ = 0;
  TransportStats stats_;
};

}  // namespace cradle
