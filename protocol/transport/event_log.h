/// Reads the files that lcm-logger writes.
///
/// Why not liblcm's lcm_eventlog: a file of 130 bytes that claims a message of 2^31 - 1 bytes ends
/// the process, a claim below that allocates 2 GiB, and one damaged event ends the reading
/// (measured, 1.3.1). A recording is a file that somebody was sent; this reader checks every length
/// against the file and the largest datagram, and goes on behind damage.
///
/// Format, big endian, one event after the other: u32 0xeda1da01, i64 number, i64 time (us since
/// 1970), i32 length of the channel's name, i32 length of the payload, name, payload.
#pragma once

#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "protocol/codec.h"

namespace cradle {

struct LoggedMessage {
  std::int64_t time_us = 0;  ///< since 1970, as the file says: any number
  std::string channel;
  Bytes payload;
};

class EventLogReader {
 public:
  /// Throws std::system_error if the file cannot be opened, or is no regular one.
  explicit EventLogReader(const std::string& path);

  /// The next whole event; nothing at the end. What is no event, or has more than 64 KiB or an
  /// event behind it that is none, is passed over; 64 MiB without an event are the end.
  std::optional<LoggedMessage> next();

  std::int64_t damages() const { return damages_; }  ///< stretches passed over

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  ByteView look(std::size_t bytes);
  std::size_t pass_over();

  std::unique_ptr<std::FILE, Closer> file_;
  Bytes buffer_;
  std::size_t begin_ = 0;  ///< of what is not taken yet
  bool is_damaged_ = false;
  std::int64_t damages_ = 0;
};

}  // namespace cradle
