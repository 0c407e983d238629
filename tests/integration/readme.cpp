// Every command that README.md tells a reader to type, typed.
#include <signal.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "tests/integration/daemon.h"

namespace cradle {
namespace {

using namespace std::chrono_literals;

/// The command lines of README.md: those of ```sh blocks, and indented ones that begin with ./ or
/// cmake, in order.
std::vector<std::string> readme_commands() {
  std::ifstream readme(CRADLE_SOURCE_DIR "/README.md");
  std::vector<std::string> commands;
  bool is_shell = false;
  for (std::string line; std::getline(readme, line);) {
    if (line.starts_with("```")) {
      is_shell = line == "```sh";
    } else if (is_shell) {
      commands.push_back(line);
    } else if (line.starts_with("    ./") || line.starts_with("    cmake ")) {
      commands.push_back(line.substr(4));
    }
  }
  return commands;
}

std::string with_replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

std::string build_folder() {
  const std::string bin = CRADLE_BIN_DIR;
  return bin.substr(0, bin.rfind('/'));
}

/// In the repository's folder, with this build's programs, on this test's own ports.
std::vector<std::string> shell(const std::string& command) {
  const std::string here = with_replaced(command, "build/", build_folder() + "/");
  const std::string exec = command.find("&&") == std::string::npos ? "exec " : "";
  return {"/bin/sh", "-c", "cd '" CRADLE_SOURCE_DIR "' && " + exec + here};
}

}  // namespace

TEST_CASE("the commands of the README do what it says") {
  ::setenv("CRADLE_LCM_URL", own_url().c_str(), 1);
  ::setenv("CRADLE_BUILD", build_folder().c_str(), 1);
  std::unique_ptr<Process> server;
  int typed = 0;
  for (const std::string& command : readme_commands()) {
    CAPTURE(command);
    ++typed;
    if (command.find("cradled serve") != std::string::npos) {
      server = std::make_unique<Process>(shell(command + " --lcm-url '" + own_url() + "'"));
      continue;
    }
    // The two scripts do not run each other's tests again: the one shows less, the other lists.
    std::string typed_command = command;
    if (command == "./server/demo.sh") typed_command += " --seconds 2";
    if (command.starts_with("./tests/run.sh")) typed_command += " -N";
    if (command.starts_with("cmake ")) {  // of this very test: nothing is left to do
      typed_command = with_replaced(command, "-B build", "-B '" + build_folder() + "'");
      typed_command =
          with_replaced(typed_command, "--build build", "--build '" + build_folder() + "'");
    }
    const Finished finished = run(shell(typed_command), 240s);
    CAPTURE(finished.output, finished.errors);
    CHECK(finished.exit_code == 0);
    CHECK(!finished.output.empty());
  }
  CHECK(typed > 10);
  REQUIRE(server);
  CHECK(server->is_running());
  server->signal(SIGTERM);
  CHECK(server->wait(2s).value_or(-1) == 0);
}

}  // namespace cradle
