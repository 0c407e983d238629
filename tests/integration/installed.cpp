#include "tests/integration/installed.h"

#include <signal.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <sstream>

namespace cradle {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

Folder::Folder() : path_(new_folder()) {}

Folder::~Folder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

std::string type(const std::string& command) {
  const Finished finished = run({"/bin/sh", "-c", command}, 240s);
  CAPTURE(command, finished.output, finished.errors);
  REQUIRE(finished.exit_code == 0);
  return finished.output;
}

void install_into(const fs::path& prefix) {
  type(CRADLE_CMAKE " --install '" CRADLE_BUILD_DIR "' --prefix '" + prefix.string() + "'");
}

std::vector<fs::path> files_below(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() || entry.is_symlink()) files.push_back(entry.path());
  }
  return files;
}

std::string content(const fs::path& file) {
  std::ifstream stream(file);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

fs::path find_program(const fs::path& folder, const std::string& name) {
  fs::path found;
  for (const fs::path& file : files_below(folder)) {
    const bool is_program =
        (fs::status(file).permissions() & fs::perms::owner_exec) != fs::perms::none;
    if (file.filename() != name || !is_program) continue;
    CAPTURE(file, found);
    REQUIRE(found.empty());
    found = file;
  }
  CAPTURE(folder, name);
  REQUIRE(!found.empty());
  return found;
}

void check_consumer(const fs::path& consumer, const fs::path& installed,
                    const std::string& environment) {
  ::setenv("CRADLE_LCM_URL", own_url().c_str(), 1);
  ::setenv("CRADLE_WORLD", "test", 1);
  std::vector<std::string> arguments = serve_arguments({"--lockstep"});  // nothing moves by itself
  arguments[0] = find_program(installed, "cradled").string();
  Process daemon(arguments);
  CHECK(type(environment + " '" + consumer.string() + "'") == "ok at 1 -2 4.5\n");
  daemon.signal(SIGTERM);
  CHECK(daemon.wait(10s).value_or(-1) == 0);
}

}  // namespace cradle
