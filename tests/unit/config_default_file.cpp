// server/deploy/cradled.toml, which operators begin with, says the defaults.
#include <catch2/catch.hpp>
#include <cctype>
#include <map>
#include <sstream>

#include "tests/unit/config_helpers.h"

namespace cradle {
namespace {

const std::string kFile = CRADLE_SOURCE_DIR "/server/deploy/cradled.toml";

}  // namespace

TEST_CASE("the shipped configuration is accepted and changes nothing") {
  CHECK(find_faults(kFile).empty());
  const LoadedConfig config = load_config({kFile, {}, {}});
  for (const Setting& setting : all_settings()) {
    CHECK(config.origins.at(setting.key).text() == "default");
  }
}

TEST_CASE("the shipped configuration without its comment signs has every key with its default") {
  std::ifstream stream(kFile);
  std::map<std::string, std::string> values;  // prose is "# like this", a setting "#key = value"
  std::string text;
  for (std::string line; std::getline(stream, line);) {
    const bool is_setting = line.size() > 1 && line[0] == '#' && std::islower(line[1]) != 0;
    if (!is_setting) continue;
    text += line.substr(1) + '\n';
    const std::size_t equals = line.find(" = ");
    REQUIRE(equals != std::string::npos);
    CHECK(values.emplace(line.substr(1, equals - 1), line.substr(equals + 3)).second);
  }
  for (const Setting& setting : all_settings()) {
    CAPTURE(setting.key);
    CHECK(values[std::string(setting.key)] == value_text(setting, Config()));
  }
  CHECK(values.size() == all_settings().size());
  CHECK(find_faults(ConfigFile(text).path()).empty());
}

}  // namespace cradle
