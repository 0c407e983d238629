#include "server/inbox.h"

#include <cradle/limits.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace cradle {
namespace {
constexpr std::size_t kOverflowMax = 4096;
}  // namespace

Inbox::Inbox() : event_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (event_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
}

Inbox::~Inbox() { ::close(event_); }

void Inbox::put(MessageKind kind, ByteView payload) {
  const std::lock_guard lock(mutex_);
  switch (check_size(kind, payload)) {
    case SizeCheck::right:
      break;
    case SizeCheck::no_count:
      ++counters_.no_count;
      return;
    case SizeCheck::bad_count:
      ++counters_.bad_count;
      return;
    case SizeCheck::wrong_size:
      ++counters_.wrong_size;
      return;
  }
  const auto bytes = static_cast<std::int64_t>(payload.size());
  if (contents_.commands.size() < static_cast<std::size_t>(limits::kInboxDatagrams) &&
      contents_.bytes + bytes <= limits::kInboxBytes) {
    contents_.commands.push_back({kind, Bytes(payload.begin(), payload.end())});
    contents_.bytes += bytes;
  } else if (const auto header = peek_header(kind, payload);
             header && contents_.overflow.size() < kOverflowMax) {
    contents_.overflow.push_back(*header);
  } else {
    ++counters_.dropped;
  }
  ::eventfd_write(event_, 1);
}

Inbox::Contents Inbox::drain() {
  const std::lock_guard lock(mutex_);
  eventfd_t count = 0;
  ::eventfd_read(event_, &count);
  return std::exchange(contents_, {});
}

Inbox::Counters Inbox::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

}  // namespace cradle
