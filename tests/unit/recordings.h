/// Recordings made by tests, in the format of lcm-logger.
#pragma once

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "protocol/codec.h"

namespace cradle::test {

/// The bytes of a file of lcm-logger.
struct Log {
  std::string bytes;

  Log& add(std::int64_t time_us, std::string_view channel, ByteView payload) {
    put(0xeda1da01, 4);
    put(0, 8);
    put(static_cast<std::uint64_t>(time_us), 8);
    put(channel.size(), 4);
    put(payload.size(), 4);
    bytes += channel;
    bytes.append(payload.begin(), payload.end());
    return *this;
  }

  /// A header that claims these lengths, and nothing behind it.
  Log& claim(std::uint64_t channel_length, std::uint64_t payload_length) {
    put(0xeda1da01, 4);
    put(0, 8);
    put(0, 8);
    put(channel_length, 4);
    put(payload_length, 4);
    return *this;
  }

  void put(std::uint64_t value, int size) {
    while (size-- > 0) bytes += static_cast<char>(value >> 8 * size);
  }
};

/// A file that is gone at the end of the scope.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& bytes) {
    path_ = (std::filesystem::temp_directory_path() / "cradle-log-XXXXXX").string();
    const int descriptor = ::mkstemp(path_.data());
    if (descriptor < 0) throw std::runtime_error("mkstemp");
    ::close(descriptor);
    write(bytes);
  }
  ~TemporaryFile() { std::filesystem::remove(path_); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void write(const std::string& bytes) { std::ofstream(path_, std::ios::binary) << bytes; }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace cradle::test
