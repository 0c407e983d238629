#include "tests/integration/process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

namespace cradle {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

void redirect(const std::string& file, int descriptor) {
  const int opened = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  ::dup2(opened, descriptor);
  ::close(opened);
}

std::string read(const std::string& file) {
  std::ifstream stream(file);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// fork(); the child dies with its parent and writes into `folder`.
int fork_into(const std::string& folder) {
  const int parent = ::getpid();
  const int pid = ::fork();
  if (pid < 0) throw std::runtime_error("fork");
  if (pid == 0) {
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(127);
    redirect(folder + "/out", STDOUT_FILENO);
    redirect(folder + "/err", STDERR_FILENO);
  }
  return pid;
}

}  // namespace

std::string new_folder() {
  // What mkdtemp is to put in is told by six X.
  std::string path = (fs::temp_directory_path() / "cradle-test-XXXXXX").string();
  if (::mkdtemp(path.data()) == nullptr) throw std::runtime_error("mkdtemp");
  return path;
}

Process::Process(std::vector<std::string> arguments) : folder_(new_folder()) {
  if (arguments.at(0).find('/') == std::string::npos) {
    arguments[0] = CRADLE_BIN_DIR "/" + arguments[0];
  }
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  pid_ = fork_into(folder_);
  if (pid_ == 0) {
    ::execv(pointers[0], pointers.data());
    ::_exit(127);
  }
}

Process::Process(const std::function<int()>& task) : folder_(new_folder()) {
  pid_ = fork_into(folder_);
  if (pid_ == 0) ::_exit(task());
}

Process::~Process() {
  ::kill(-pid_, SIGKILL);  // with what it has started
  wait(std::chrono::seconds(10));
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

std::optional<int> Process::wait(std::chrono::milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  while (!exit_code_) {
    int status = 0;
    const int ended = ::waitpid(pid_, &status, WNOHANG);
    if (ended == pid_) {
      exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    } else if (Clock::now() >= deadline) {
      return std::nullopt;
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  return exit_code_;
}

void Process::signal(int number) const { ::kill(pid_, number); }

long Process::resident_kB() const {
  std::ifstream status("/proc/" + std::to_string(pid_) + "/status");
  for (std::string word; status >> word;) {
    if (word != "VmRSS:") continue;
    long kilobytes = 0;
    status >> kilobytes;
    return kilobytes;
  }
  return 0;
}

std::string Process::output() const { return read(folder_ + "/out"); }
std::string Process::errors() const { return read(folder_ + "/err"); }

Finished run(std::vector<std::string> arguments, std::chrono::milliseconds timeout) {
  Process process(std::move(arguments));
  const auto code = process.wait(timeout);
  return {code.value_or(-1), process.output(), process.errors()};
}

std::string own_url() {
  // Each test case is a process of its own, and its number is nobody else's while it lives. Ports
  // from 32768 on are what Linux lends to sockets that ask for none, and one of those may be
  // another test's.
  static const int port = 10000 + 2 * (::getpid() % 11000);
  return "udpm://239.255.76.67:" + std::to_string(port) + "?ttl=0";
}

std::vector<std::string> serve_arguments(std::vector<std::string> more) {
  std::vector<std::string> all = {"cradled", "serve", "--world", "test", "--lcm-url", own_url()};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

long anonymous_kB(int process) {
  std::ifstream rollup("/proc/" + std::to_string(process) + "/smaps_rollup");
  for (std::string word; rollup >> word;) {
    if (word != "Anonymous:") continue;
    long kilobytes = 0;
    rollup >> kilobytes;
    return kilobytes;
  }
  return 0;
}

int line_count(const std::string& text) {
  return static_cast<int>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace cradle
