// Defaults < file < environment < flags: which wins, what is refused, and how it is told.
#include <catch2/catch.hpp>
#include <sstream>

#include "tests/unit/config_helpers.h"

namespace cradle {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

std::string printed(const LoadedConfig& config) {
  std::ostringstream out;
  print_config(out, config);
  return out.str();
}

/// A value of the key that is not its default, as the environment and flags have it.
std::string other_value(const Setting& setting) {
  if (setting.key == "world") return "other";
  if (setting.key == "lcm_url") return "udpm://239.1.2.3:8000?ttl=1";
  if (setting.key == "rate_hz") return "62.5";
  if (setting.key == "datagram_bytes") return "600";
  if (setting.key == "log_level") return "warn";
  if (setting.key == "log_format") return "json";
  if (setting.key == "metrics") return "127.0.0.1:9464";
  if (std::holds_alternative<bool Config::*>(setting.field)) {
    return value_text(setting, Config()) == "true" ? "false" : "true";
  }
  return "7";
}

/// As TOML; texts in the quotes that need no escapes.
std::string quoted_value(const Setting& setting, const std::string& text) {
  return std::holds_alternative<std::string Config::*>(setting.field) ? "'" + text + "'" : text;
}

}  // namespace

TEST_CASE("each layer of the configuration yields to the next, for every key") {
  for (const Setting& setting : all_settings()) {
    CAPTURE(setting.key);
    const std::string key(setting.key), other = other_value(setting);
    const auto is_other = [&](const LoadedConfig& config, const std::string& origin) {
      CHECK(config.origins.at(setting.key).text() == origin);
      return value_text(setting, config.values) != value_text(setting, Config());
    };
    // The weaker layer says the default, the stronger one something else; then the other way.
    std::string standard = value_text(setting, Config());
    std::erase(standard, '"');
    const ConfigFile says_other(key + " = " + quoted_value(setting, other));
    const ConfigFile says_standard(key + " = " + quoted_value(setting, standard));
    CHECK_FALSE(is_other(load_config({says_standard.path(), {}, {}}), says_standard.path() + ":1"));
    CHECK(is_other(load_config({says_other.path(), {}, {}}), says_other.path() + ":1"));
    CHECK(is_other(load_config({says_standard.path(), {{setting.variable(), other}}, {}}),
                   setting.variable()));
    CHECK_FALSE(is_other(load_config({says_other.path(), {{setting.variable(), standard}}, {}}),
                         setting.variable()));
    CHECK(is_other(
        load_config(
            {says_standard.path(), {{setting.variable(), standard}}, {{setting.flag(), other}}}),
        setting.flag()));
    CHECK_FALSE(is_other(
        load_config(
            {says_other.path(), {{setting.variable(), other}}, {{setting.flag(), standard}}}),
        setting.flag()));
  }
}

TEST_CASE("a value of the environment that is wrong names its variable") {
  const std::pair<std::string, std::string> cases[] = {
      {"CRADLE_THREADS", "must be an integer, not \"two\""},
      {"CRADLE_RATE_HZ", "must be a number, not \"two\""},
      {"CRADLE_LOCKSTEP", "must be true or false, not \"two\""},
      {"CRADLE_LOG_LEVEL", "\"two\" is none of trace"},
      {"CRADLE_LCM_URL", "\"two\" is not like udpm://"},
  };
  for (const auto& [variable, reason] : cases) {
    try {
      load_config({std::nullopt, {{variable, "two"}}, {}});
      FAIL("accepted");
    } catch (const ConfigError& error) {
      CHECK_THAT(error.what(), StartsWith(variable + ": " + reason));
      CHECK(error.exit_code == 78);
    }
  }
  for (const char* text : {"", " 1", "1 ", "0x2", "1.5", "99999999999", "257"}) {
    CAPTURE(text);
    CHECK_THROWS_AS(load_config({std::nullopt, {{"CRADLE_THREADS", text}}, {}}), ConfigError);
  }
  for (const char* text : {"", "nan", "inf", "1e9", "60 Hz"}) {
    CAPTURE(text);
    CHECK_THROWS_AS(load_config({std::nullopt, {{"CRADLE_RATE_HZ", text}}, {}}), ConfigError);
  }
}

TEST_CASE("a variable CRADLE_... that is no key is refused with the nearest one") {
  CHECK_THROWS_WITH(load_config({std::nullopt, {{"CRADLE_WROLD", "a"}}, {}}),
                    "CRADLE_WROLD: unknown variable of the environment; "
                    "did you mean 'CRADLE_WORLD'?");
  CHECK_THROWS_WITH(load_config({std::nullopt, {{"CRADLE_world", "a"}}, {}}),
                    Contains("did you mean 'CRADLE_WORLD'?"));
  CHECK_THROWS_WITH(load_config({std::nullopt, {{"CRADLE_RATE", "60"}}, {}}),
                    Contains("did you mean 'CRADLE_RATE_HZ'?"));
  CHECK_NOTHROW(
      load_config({std::nullopt, {{"CRADLE_BUILD", "of our scripts"}, {"PATH", "x"}}, {}}));
}

TEST_CASE("a wrong flag is wrong usage, and names the flag") {
  try {
    load_config({std::nullopt, {}, {{"--threads", "many"}}});
    FAIL("accepted");
  } catch (const ConfigError& error) {
    CHECK(error.what() == std::string("--threads: must be an integer, not \"many\""));
    CHECK(error.exit_code == 64);
  }
}

TEST_CASE("a fault of a weaker layer is refused though a stronger one overrides the value") {
  const ConfigFile file("threads = 0");
  CHECK_THROWS_AS(load_config({file.path(), {{"CRADLE_THREADS", "2"}}, {{"--threads", "2"}}}),
                  ConfigError);
  CHECK_THROWS_AS(load_config({std::nullopt, {{"CRADLE_THREADS", "0"}}, {{"--threads", "2"}}}),
                  ConfigError);
}

TEST_CASE("the printed configuration is a configuration that prints the same values") {
  const ConfigFile file(
      "scene = \"sub/a \\\"b\\\\c.toml\"\nrate_hz = 62.5\nallow_control = false\n");
  const LoadedConfig first = load_config({file.path(),
                                          {{"CRADLE_THREADS", "3"}, {"CRADLE_WORLD", "a"}},
                                          {{"--world", "b"}, {"--lockstep", "true"}}});
  const std::string text = printed(first);
  CAPTURE(text);
  CHECK_THAT(text, Contains("world = \"b\"  # --world\n"));
  CHECK_THAT(text, Contains("threads = 3  # CRADLE_THREADS\n"));
  CHECK_THAT(text, Contains("rate_hz = 62.5  # " + file.path() + ":2\n"));
  CHECK_THAT(text, Contains("log_level = \"info\"  # default\n"));
  const ConfigFile again(text);  // in another folder
  const LoadedConfig second = load_config({again.path(), {}, {}});
  for (const Setting& setting : all_settings()) {
    CHECK(value_text(setting, second.values) == value_text(setting, first.values));
  }
}

TEST_CASE("a path of the command line is printed as it is found from anywhere") {
  const LoadedConfig config = load_config({std::nullopt, {}, {{"--scene", "a.toml"}}});
  CHECK(config.values.scene == "a.toml");
  CHECK_THAT(printed(config),
             Contains("scene = \"" + (std::filesystem::current_path() / "a.toml").string() + '"'));
}

}  // namespace cradle
