#include "tests/bench/in_child.h"

#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <iostream>
#include <system_error>

#include "server/stopwatch.h"

namespace cradle::bench {
namespace {

// What a child says begins with one of these; that it passes on is all it says for now.
constexpr char kDone = 'd', kFailed = 'f', kPassed = 'p';
constexpr char kGo = 'g';  // what it is told

void write_all(int file, const std::string& text) {
  for (std::size_t sent = 0; sent < text.size();) {
    const ssize_t n = write(file, text.data() + sent, text.size() - sent);
    if (n < 0 && errno != EINTR) _exit(1);
    if (n > 0) sent += static_cast<std::size_t>(n);
  }
}

void wait_for_turn(int file) {
  char told = 0;
  while (read(file, &told, 1) < 0 && errno == EINTR) {
  }
  if (told != kGo) _exit(1);
}

[[noreturn]] void be_the_child(const ChildWork& work, int file) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  // Whoever called may catch these, to speak for itself.
  for (const int number : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTERM, SIGINT})
    signal(number, SIG_DFL);
  wait_for_turn(file);
  std::string said;
  try {
    said = kDone + work([file] {
             write_all(file, {kPassed});
             wait_for_turn(file);
           });
  } catch (const std::exception& error) {
    said = kFailed + std::string("failed: ") + error.what();
  }
  write_all(file, said);
  _exit(0);  // what was not flushed here is the parent's
}

class Child {
 public:
  explicit Child(const ChildWork& work) {
    std::array<int, 2> ends{};
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()) != 0)
      throw std::system_error(errno, std::generic_category(), "socketpair");
    process_ = fork();
    if (process_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
    if (process_ == 0) {
      close(ends[0]);
      be_the_child(work, ends[1]);
    }
    close(ends[1]);
    file_ = ends[0];
  }

  bool has_ended() const { return has_ended_; }
  /// Until it passes on, or ends.
  void have_turn(double limit_s) {
    const Stopwatch stopwatch;
    send(file_, &kGo, 1, MSG_NOSIGNAL);  // if it is dead, that is read
    while (hear(limit_s - used_s_ - 1e-6 * stopwatch.elapsed_us())) {
    }
    used_s_ += 1e-6 * stopwatch.elapsed_us();
  }
  /// Of one that has ended.
  ChildResult result(double limit_s) const {
    if (is_late_) return {false, "no end in " + std::to_string(std::lround(limit_s)) + " s"};
    if (WIFSIGNALED(status_)) {
      return {false, std::string("crashed: ") + strsignal(WTERMSIG(status_))};
    }
    if (WEXITSTATUS(status_) != 0 || text_.empty()) return {false, "crashed: it ended by itself"};
    return {text_[0] == kDone, text_.substr(1)};
  }

 private:
  /// False: its turn is over.
  bool hear(double left_s) {
    is_late_ = left_s <= 0;
    if (is_late_) return end();
    pollfd wanted{file_, POLLIN, 0};
    if (poll(&wanted, 1, static_cast<int>(1000 * left_s) + 1) <= 0) return true;
    std::array<char, 4096> part;
    const ssize_t n = read(file_, part.data(), part.size());
    if (n == 0 || (n < 0 && errno != EINTR)) return end();
    if (n > 0) text_.append(part.data(), static_cast<std::size_t>(n));
    if (text_ != std::string{kPassed}) return true;
    text_.clear();
    return false;
  }
  bool end() {
    if (is_late_) kill(process_, SIGKILL);
    while (waitpid(process_, &status_, 0) < 0 && errno == EINTR) {
    }
    close(file_);
    has_ended_ = true;
    return false;
  }

  pid_t process_;
  int file_;
  std::string text_;
  double used_s_ = 0;
  bool has_ended_ = false, is_late_ = false;
  int status_ = 0;
};

}  // namespace

std::vector<ChildResult> in_children(const std::vector<ChildWork>& works, double limit_s) {
  std::cout.flush();
  std::vector<Child> children;
  for (const ChildWork& work : works) children.emplace_back(work);
  while (!std::ranges::all_of(children, &Child::has_ended)) {
    for (Child& child : children) {
      if (!child.has_ended()) child.have_turn(limit_s);
    }
  }
  std::vector<ChildResult> results;
  for (const Child& child : children) results.push_back(child.result(limit_s));
  return results;
}

ChildResult in_child(const std::function<std::string()>& work, double limit_s) {
  const ChildWork alone = [&](const PassOn&) { return work(); };
  return in_children({alone}, limit_s).front();
}

}  // namespace cradle::bench
