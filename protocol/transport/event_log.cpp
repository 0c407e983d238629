#include "protocol/transport/event_log.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

namespace cradle {
namespace {

constexpr std::array<std::uint8_t, 4> kSync = {0xed, 0xa1, 0xda, 0x01};
constexpr std::size_t kEventHeaderBytes = 28;
constexpr std::size_t kTimeAt = 12, kChannelLengthAt = 20, kPayloadLengthAt = 24;
constexpr std::size_t kChannelMax = 63;       // of LCM
constexpr std::size_t kPayloadMax = 1 << 16;  // of a datagram
constexpr std::size_t kReadBytes = 1 << 18;
constexpr std::size_t kDamageMax = 1 << 26;  // a longer stretch ends the reading

bool begins_event(ByteView bytes) {
  return bytes.size() >= kSync.size() && std::equal(kSync.begin(), kSync.end(), bytes.begin());
}

}  // namespace

EventLogReader::EventLogReader(const std::string& path) {
  // A pipe must not be waited for.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor >= 0) file_.reset(::fdopen(descriptor, "rb"));
  struct stat status {};
  if (!file_ || ::fstat(::fileno(file_.get()), &status) != 0) {
    throw std::system_error(errno, std::generic_category());
  }
  // Neither a folder nor what has no end.
  const int error = S_ISDIR(status.st_mode) ? EISDIR : S_ISREG(status.st_mode) ? 0 : EINVAL;
  if (error != 0) throw std::system_error(error, std::generic_category());
}

/// The next bytes of the file, at most so many; fewer at its end.
ByteView EventLogReader::look(std::size_t bytes) {
  if (buffer_.size() - begin_ < bytes) {
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(begin_));
    begin_ = 0;
    const std::size_t had = buffer_.size();
    buffer_.resize(std::max(bytes, kReadBytes));
    buffer_.resize(had + std::fread(buffer_.data() + had, 1, buffer_.size() - had, file_.get()));
  }
  return ByteView(buffer_).subspan(begin_, std::min(bytes, buffer_.size() - begin_));
}

/// Goes on to the next byte that may begin an event; how many bytes that was.
std::size_t EventLogReader::pass_over() {
  if (!is_damaged_) ++damages_;
  is_damaged_ = true;
  const std::size_t before = begin_;
  const auto begin = buffer_.begin() + static_cast<std::ptrdiff_t>(begin_) + 1;
  begin_ = static_cast<std::size_t>(std::find(begin, buffer_.end(), kSync[0]) - buffer_.begin());
  return begin_ - before;
}

std::optional<LoggedMessage> EventLogReader::next() {
  std::size_t passed_over = 0;
  while (passed_over <= kDamageMax && !look(1).empty()) {
    const ByteView header = look(kEventHeaderBytes);
    if (header.size() < kEventHeaderBytes || !begins_event(header)) {
      passed_over += pass_over();
      continue;
    }
    const std::uint64_t channel_length = read_big_endian(header.subspan(kChannelLengthAt, 4));
    const std::uint64_t payload_length = read_big_endian(header.subspan(kPayloadLengthAt, 4));
    if (channel_length == 0 || channel_length > kChannelMax || payload_length > kPayloadMax) {
      passed_over += pass_over();
      continue;
    }
    const std::size_t size = kEventHeaderBytes + channel_length + payload_length;
    const ByteView event = look(size + kSync.size());
    const bool is_last = event.size() == size;
    if (event.size() < size || !(is_last || begins_event(event.subspan(size)))) {
      passed_over += pass_over();
      continue;
    }
    is_damaged_ = false;
    begin_ += size;
    const ByteView channel = event.subspan(kEventHeaderBytes, channel_length);
    const ByteView payload = event.subspan(kEventHeaderBytes + channel_length, payload_length);
    return LoggedMessage{static_cast<std::int64_t>(read_big_endian(event.subspan(kTimeAt, 8))),
                         {channel.begin(), channel.end()},
                         {payload.begin(), payload.end()}};
  }
  return std::nullopt;
}

}  // namespace cradle
