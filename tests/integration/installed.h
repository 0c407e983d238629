/// What tests of the installed files share: folders, command lines, a prefix, a daemon of it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/integration/process.h"

namespace cradle {

/// An empty folder, gone with all that is in it at the end of the scope.
class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Types a command line; the test fails, with what was said, unless it succeeds. What it printed.
std::string type(const std::string& command);

/// `cmake --install` of this build into `prefix`.
void install_into(const std::filesystem::path& prefix);

/// Every regular file and link below `folder`.
std::vector<std::filesystem::path> files_below(const std::filesystem::path& folder);

std::string content(const std::filesystem::path& file);

/// The one program of this name below `folder`; the test fails if there are none or two.
std::filesystem::path find_program(const std::filesystem::path& folder, const std::string& name);

/// Runs `consumer`, built of tests/integration/consumer, against the daemon of a prefix or root.
/// The test fails unless it says what it should. `environment`: NAME=VALUE ... for the consumer.
void check_consumer(const std::filesystem::path& consumer, const std::filesystem::path& installed,
                    const std::string& environment = "");

}  // namespace cradle
