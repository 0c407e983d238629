/// Real processes for tests: started, watched, and ended whatever the test does.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace cradle {

/// The path of a new, empty folder, which is the caller's to remove.
std::string new_folder();

/// A program with its output in files; killed and waited for at the end of the scope.
class Process {
 public:
  /// `arguments[0]` is the program: a path, or a name in the build's bin folder.
  explicit Process(std::vector<std::string> arguments);
  /// A child of this process that runs `task` and exits with what it returns. No Catch in there.
  explicit Process(const std::function<int()>& task);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// The exit code, 128 + n after signal n; nothing if it still runs after `timeout`.
  std::optional<int> wait(std::chrono::milliseconds timeout);
  bool is_running() { return !wait(std::chrono::milliseconds(0)); }
  void signal(int number) const;
  long resident_kB() const;  ///< of memory
  int id() const { return pid_; }

  std::string output() const;  ///< so far
  std::string errors() const;  ///< so far

 private:
  std::string folder_;
  int pid_ = -1;
  std::optional<int> exit_code_;
};

/// What a program that ends by itself came to.
struct Finished {
  int exit_code = -1;  ///< -1: it did not end within the time
  std::string output;
  std::string errors;
};
Finished run(std::vector<std::string> arguments,
             std::chrono::milliseconds timeout = std::chrono::seconds(60));

/// An LCM URL whose ports no other test that runs now has.
std::string own_url();

/// The arguments of `cradled serve` for the world "test" on own_url(), and some more.
std::vector<std::string> serve_arguments(std::vector<std::string> more = {});

/// Memory of a process that no file stands behind, kB (proc(5), smaps_rollup); 0 if that cannot be
/// read. Unlike the resident size it does not change with who else runs the same program.
long anonymous_kB(int process);

/// Lines in `text`.
int line_count(const std::string& text);

}  // namespace cradle
