#include "tests/integration/help.h"

#include <catch2/catch.hpp>
#include <regex>
#include <sstream>

#include "tests/integration/process.h"

namespace cradle {
namespace {

std::vector<std::string> help_lines(std::vector<std::string> command) {
  command.push_back("--help");
  const Finished finished = run(command);
  REQUIRE(finished.exit_code == 0);
  std::vector<std::string> lines;
  std::istringstream stream(finished.output);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

}  // namespace

std::vector<std::string> subcommands_of(const std::string& program) {
  std::vector<std::string> found;
  bool is_list = false;
  for (const std::string& line : help_lines({program})) {
    if (is_list && line.empty()) break;
    if (is_list) found.push_back(line.substr(2, line.find(' ', 2) - 2));
    if (line == "Subcommands:") is_list = true;
  }
  CHECK(found.size() > 1);  // or the help was not understood
  return found;
}

std::set<std::string> flags_of(const std::string& program, const std::string& subcommand) {
  const std::regex option("^ {2,4}(?:-[a-zA-Z],)?(--[a-z][a-z-]*)");
  std::vector<std::string> command = {program};
  if (!subcommand.empty()) command.push_back(subcommand);
  std::set<std::string> found;
  for (const std::string& line : help_lines(command)) {
    std::smatch match;
    if (std::regex_search(line, match, option)) found.insert(match[1]);
  }
  CHECK(found.count("--help") == 1);
  return found;
}

}  // namespace cradle
