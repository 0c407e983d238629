// The manual pages, as a reader sees them: they render without a warning, and tell of every
// subcommand, option, scene key and configuration key that there is, and of no other.
#include <catch2/catch.hpp>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include "tests/integration/help.h"
#include "tests/integration/installed.h"

namespace cradle {
namespace {

const std::string kDaemonPage = CRADLE_SOURCE_DIR "/server/man/cradled.8";
const std::string kScenePage = CRADLE_SOURCE_DIR "/server/man/cradled-scene.5";
const std::string kToolPage = CRADLE_SOURCE_DIR "/client/man/cradle.1";

/// Plain text, no line broken.
std::string rendered(const std::string& page) {
  return type("groff -mdoc -ww -Tascii -P-cbu -rLL=2000n '" + page + "'");
}

/// The text below each heading, of the main ones and of those within.
std::map<std::string, std::string> sections(const std::string& page) {
  std::map<std::string, std::string> found;
  std::string main, inner;
  std::istringstream stream(rendered(page));
  for (std::string line; std::getline(stream, line);) {
    const std::size_t indent = line.find_first_not_of(' ');
    if (indent == 0) main = line, inner.clear();
    if (indent == 3) inner = line.substr(3);
    found[main] += line + '\n';
    if (!inner.empty()) found[inner] += line + '\n';
  }
  return found;
}

std::set<std::string> flags_in(const std::string& text) {
  const std::regex flag("--[a-z][a-z-]*");
  std::set<std::string> found;
  for (std::sregex_iterator it(text.begin(), text.end(), flag), end; it != end; ++it) {
    found.insert(it->str());
  }
  return found;
}

/// The keys of tests/scenes/README.md by the heading above their table.
std::map<std::string, std::set<std::string>> documented_keys() {
  std::map<std::string, std::set<std::string>> keys;
  std::ifstream stream(CRADLE_SCENE_DIR "/README.md");
  const std::regex heading("#+ `?([^`]*)`?"), row("\\| `([a-z_0-9]+)` \\|.*");
  std::string current;
  std::smatch match;
  for (std::string line; std::getline(stream, line);) {
    if (std::regex_match(line, match, heading)) current = match[1];
    if (std::regex_match(line, match, row)) keys[current].insert(match[1]);
  }
  return keys;
}

/// The heads of the lists in a text: five spaces, and then the key, alone or before its meaning.
std::set<std::string> keys_in(const std::string& text) {
  const std::regex head("^ {5}([a-z][a-z_0-9]*)(  .*)?$");
  std::set<std::string> found;
  std::istringstream stream(text);
  std::smatch match;
  for (std::string line; std::getline(stream, line);) {
    if (std::regex_match(line, match, head)) found.insert(match[1]);
  }
  return found;
}

}  // namespace

TEST_CASE("the manual pages render without a warning") {
  for (const std::string& page : {kDaemonPage, kScenePage, kToolPage}) {
    CAPTURE(page);
    const Finished finished = run({"/bin/sh", "-c", "groff -mdoc -ww -Tutf8 '" + page + "'"});
    CHECK(finished.exit_code == 0);
    CHECK(finished.errors.empty());
    CHECK(line_count(finished.output) > 50);
  }
}

TEST_CASE("the manual pages tell of every subcommand and of its options, and of no others") {
  for (const auto& [program, page] :
       {std::pair{std::string("cradled"), kDaemonPage}, {std::string("cradle"), kToolPage}}) {
    const auto text = sections(page);
    std::set<std::string> known = flags_of(program);
    for (const std::string& subcommand : subcommands_of(program)) {
      CAPTURE(program, subcommand);
      REQUIRE(text.contains(subcommand));
      const std::set<std::string> told = flags_in(text.at(subcommand));
      for (const std::string& flag : flags_of(program, subcommand)) {
        CAPTURE(flag);
        CHECK((flag == "--help" || told.contains(flag)));
        known.insert(flag);
      }
    }
    const std::set<std::string> all = flags_in(rendered(page));
    for (const std::string& flag : flags_of(program)) CHECK(all.contains(flag));
    for (const std::string& flag : all) {
      CAPTURE(program, flag);
      CHECK(known.contains(flag));
    }
  }
}

TEST_CASE("the manual pages list exactly the keys of scenes and of the configuration") {
  const auto documented = documented_keys();
  CHECK(documented.size() == 7);
  const auto scene = sections(kScenePage);
  const auto daemon = sections(kDaemonPage);
  for (const auto& [heading, keys] : documented) {
    CAPTURE(heading);
    const auto& page = heading == "Configuration" ? daemon : scene;
    const std::string name = heading == "Configuration" ? "CONFIGURATION" : heading;
    REQUIRE(page.contains(name));
    CHECK(keys_in(page.at(name)) == keys);
  }
}

TEST_CASE("the scene in the manual is one that runs") {
  const Folder folder;
  std::ifstream page(kScenePage);
  std::ofstream scene(folder.path() / "example.toml");
  bool is_scene = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with(".Ed")) is_scene = false;
    if (is_scene) scene << line << '\n';
    if (line.starts_with(".Bd -literal")) is_scene = true;
  }
  scene.close();
  const Finished finished = run({"cradled", "simulate", (folder.path() / "example.toml").string(),
                                 "--duration", "1", "--summary", "-"});
  CAPTURE(finished.errors);
  CHECK(finished.exit_code == 0);
  CHECK_THAT(finished.output, Catch::Matchers::Contains("\"bodies\": 32"));
}

}  // namespace cradle
