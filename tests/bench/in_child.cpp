#include "tests/bench/in_child.h"

#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <iostream>
#include <system_error>

#include "server/stopwatch.h"

namespace cradle::bench {
namespace {

// What a child says begins with one of these.
constexpr char kDone = 'd', kFailed = 'f';

void write_all(int file, const std::string& text) {
  for (std::size_t sent = 0; sent < text.size();) {
    const ssize_t n = write(file, text.data() + sent, text.size() - sent);
    if (n < 0 && errno != EINTR) _exit(1);
    if (n > 0) sent += static_cast<std::size_t>(n);
  }
}

[[noreturn]] void be_the_child(const std::function<std::string()>& work, int file) {
  // Whoever called may catch these, to speak for itself.
  for (const int number : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTERM, SIGINT})
    signal(number, SIG_DFL);
  std::string said;
  try {
    said = kDone + work();
  } catch (const std::exception& error) {
    said = kFailed + std::string("failed: ") + error.what();
  }
  write_all(file, said);
  _exit(0);  // what was not flushed here is the parent's
}

/// All that comes until the other end is closed. False: it took too long.
bool read_all(int file, double limit_s, std::string& text) {
  const Stopwatch stopwatch;
  std::array<char, 4096> part;
  for (;;) {
    const double left_s = limit_s - 1e-6 * stopwatch.elapsed_us();
    if (left_s <= 0) return false;
    pollfd wanted{file, POLLIN, 0};
    if (poll(&wanted, 1, static_cast<int>(1000 * left_s) + 1) <= 0) continue;
    const ssize_t n = read(file, part.data(), part.size());
    if (n == 0) return true;
    if (n > 0) text.append(part.data(), static_cast<std::size_t>(n));
  }
}

}  // namespace

ChildResult in_child(const std::function<std::string()>& work, double limit_s) {
  std::array<int, 2> ends{};
  std::cout.flush();
  if (pipe(ends.data()) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
  const pid_t child = fork();
  if (child < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (child == 0) {
    close(ends[0]);
    be_the_child(work, ends[1]);
  }
  close(ends[1]);
  std::string text;
  const bool is_in_time = read_all(ends[0], limit_s, text);
  close(ends[0]);
  if (!is_in_time) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!is_in_time) return {false, "no end in " + std::to_string(std::lround(limit_s)) + " s"};
  if (WIFSIGNALED(status)) {
    return {false, std::string("crashed: ") + strsignal(WTERMSIG(status))};
  }
  if (WEXITSTATUS(status) != 0 || text.empty()) return {false, "crashed: it ended by itself"};
  return {text[0] == kDone, text.substr(1)};
}

}  // namespace cradle::bench
