// What configuration files say, and how wrong ones are refused. Keys: tests/scenes/README.md.
#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <fstream>

#include "server/toml_reader.h"
#include "tests/unit/config_helpers.h"

namespace cradle {
namespace {

/// All that is wrong with a file of this text, without its folder; empty if nothing is.
std::string refusal_of(const std::string& text) {
  const ConfigFile file(text);
  std::string all;
  for (const std::string& fault : find_faults(file.path())) {
    all += fault.substr(file.folder().string().size() + 1) + '\n';
  }
  return all;
}

}  // namespace

TEST_CASE("every key of a configuration is read") {
  const ConfigFile file(R"(
world = "arena-2"
lcm_url = "udpm://239.1.2.3:8000?ttl=1"
rate_hz = 120
scene = "scenes/a.toml"
lockstep = true
allow_control = false
allow_shutdown = true
datagram_bytes = 1400
threads = 2
memory_mib = 3
bodies_max = 7
wrenches_max = 8
log_level = "debug"
log_format = "json"
metrics = "[::1]:9464"
)");
  const LoadedConfig loaded = load_config({file.path(), {}, {}});
  const Config& config = loaded.values;
  CHECK(config.world == "arena-2");
  CHECK(config.lcm_url == "udpm://239.1.2.3:8000?ttl=1");
  CHECK(config.rate_hz == 120);
  CHECK(config.scene == (file.folder() / "scenes/a.toml").string());
  CHECK(config.lockstep);
  CHECK(!config.allow_control);
  CHECK(config.allow_shutdown);
  CHECK(config.datagram_bytes == 1400);
  CHECK(config.threads == 2);
  CHECK(config.memory_mib == 3);
  CHECK(config.bodies_max == 7);
  CHECK(config.wrenches_max == 8);
  CHECK(config.log_level == "debug");
  CHECK(config.log_format == "json");
  CHECK(config.metrics == "[::1]:9464");
  // Nothing was forgotten above: each value is another than the default, and is the file's.
  int line = 1;
  for (const Setting& setting : all_settings()) {
    CAPTURE(setting.key);
    CHECK(value_text(setting, config) != value_text(setting, Config()));
    CHECK(loaded.origins.at(setting.key).text() == file.path() + ":" + std::to_string(++line));
  }
}

TEST_CASE("a scene's absolute path stays, and no scene stays none") {
  const auto scene_of_file = [](const std::string& text) {
    return load_config({ConfigFile(text).path(), {}, {}}).values.scene;
  };
  CHECK(scene_of_file("scene = '/some/where.toml'") == "/some/where.toml");
  CHECK(scene_of_file("").empty());
}

TEST_CASE("a wrong configuration is refused with file, line and reason") {
  struct Case {
    std::string text;
    std::string refusal;  // begins like this
  };
  const Case cases[] = {
      {"world = ", "cradled.toml:1: "},
      {"\nword = 'w'", "cradled.toml:2: unknown key 'word'; did you mean 'world'?"},
      {"rate = 60", "cradled.toml:1: unknown key 'rate'; did you mean 'rate_hz'?"},
      {"[section]", "cradled.toml:1: unknown key 'section'; known here: world, lcm_url, "},
      {"\n[[body]]", "cradled.toml: is a scene, not a configuration: try cradled explain "},
      {"\n\nthreads = 'two'", "cradled.toml:3: threads: must be an integer, not of type string"},
      {"world = ''", "cradled.toml:1: world: \"\" is not 1 to 24 letters"},
      {"world = 'a.b'", "cradled.toml:1: world: \"a.b\" is not 1 to 24 letters"},
      {"\nlcm_url = 'tcpq://'", "cradled.toml:2: lcm_url: \"tcpq://\" is not like udpm://"},
      {"rate_hz = 0.5", "cradled.toml:1: rate_hz: must be 0 (as the scene says) or 1 to 10000"},
      {"rate_hz = 10001", "cradled.toml:1: rate_hz: must be 0"},
      {"rate_hz = nan", "cradled.toml:1: rate_hz: must be 0"},
      {"datagram_bytes = 511", "cradled.toml:1: datagram_bytes: must be 0"},
      {"datagram_bytes = 60001", "cradled.toml:1: datagram_bytes: must be 0"},
      {"threads = 0", "cradled.toml:1: threads: must be 1 to 256"},
      {"memory_mib = 65537", "cradled.toml:1: memory_mib: must be 0 to 65536"},
      {"bodies_max = -1", "cradled.toml:1: bodies_max: must be 0 to 1000000"},
      {"wrenches_max = 1000001", "cradled.toml:1: wrenches_max: must be 0 to 1000000"},
      {"threads = 257", "cradled.toml:1: threads: must be 1 to 256"},
      {"log_format = 'xml'", "cradled.toml:1: log_format: \"xml\" is neither text nor json"},
      {"metrics = '0.0.0.0:9464'",
       "cradled.toml:1: metrics: \"0.0.0.0:9464\" is not an address of loopback like 127"},
      {"log_level = 'loud'", "cradled.toml:1: log_level: \"loud\" is none of trace, debug, info"},
  };
  for (const Case& c : cases) {
    CAPTURE(c.text);
    CHECK_THAT(refusal_of(c.text), Catch::Matchers::StartsWith(c.refusal));
    CHECK_THROWS_AS(load_config({ConfigFile(c.text).path(), {}, {}}), ConfigError);
  }
}

TEST_CASE("all faults of a configuration are found, in the order of its lines") {
  const std::string text =
      "threads = 0\nwrold = 'w'\n\nlockstep = 1\nrate_hz = 60\nscene = 'none.toml'\nbodies = 3\n";
  const std::string all = refusal_of(text);
  CAPTURE(all);
  std::istringstream lines(all);
  for (const char* begin :
       {"cradled.toml:1: threads: must be", "cradled.toml:2: unknown key 'wrold'",
        "cradled.toml:4: lockstep: must be true or false", "cradled.toml:6: scene: ",
        "cradled.toml:7: unknown key 'bodies'; did you mean 'bodies_max'?"}) {
    std::string line;
    std::getline(lines, line);
    CHECK_THAT(line, Catch::Matchers::StartsWith(begin));
  }
  CHECK(lines.peek() == EOF);
  // A start needs only the first, and says where the others are.
  CHECK_THROWS_WITH(load_config({ConfigFile(text).path(), {}, {}}),
                    Catch::Matchers::Contains(":1: threads") &&
                        Catch::Matchers::EndsWith("(cradled check tells all 4)"));
}

TEST_CASE("what is no TOML is one fault, at its line") {
  const std::string all = refusal_of("threads = 0\nworld = 'a\n");
  CHECK_THAT(all, Catch::Matchers::StartsWith("cradled.toml:2: "));
  CHECK(std::count(all.begin(), all.end(), '\n') == 1);
}

TEST_CASE("a wrong scene is a wrong value, with its own place") {
  const ConfigFile file("world = 'a'\nscene = 'scene.toml'\n");
  const std::string scene = (file.folder() / "scene.toml").string();
  const auto only_fault = [&] {
    const auto faults = find_faults(file.path());
    REQUIRE(faults.size() == 1);
    return faults[0];
  };
  CHECK(only_fault() == file.path() + ":2: scene: " + scene + ": No such file or directory");
  std::ofstream(scene) << "[world]\nrate = 1\n";
  CHECK_THAT(only_fault(), Catch::Matchers::StartsWith(file.path() + ":2: scene: " + scene +
                                                       ":2: unknown key 'rate'"));
  std::ofstream(scene) << "[[body]]\nmass_kg = 1\n";
  CHECK(find_faults(file.path()).empty());
  std::ofstream(file.path()) << "bodies_max = 0\nscene = 'scene.toml'\n";
  CHECK_THAT(only_fault(), Catch::Matchers::StartsWith(file.path() + ":2: scene: "));
}

TEST_CASE("values at the limits of a configuration are accepted") {
  for (const std::string text : {"rate_hz = 1", "rate_hz = 10000", "datagram_bytes = 512",
                                 "datagram_bytes = 60000", "threads = 256", "memory_mib = 65536",
                                 "log_level = 'off'", "world = 'abcdefghijklmnopqrstuvwx'"}) {
    CHECK(refusal_of(text) == "");
  }
}

TEST_CASE("only a regular file of a reasonable size is read") {
  // Each of these would hold up a running world that reads its configuration again.
  const ConfigFile file("");
  const std::string folder = file.folder().string();
  const std::string pipe = folder + "/pipe", large = folder + "/large.toml";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  std::ofstream(large) << "# ";
  std::filesystem::resize_file(large, kFileBytesMax + 1);
  const auto error_of = [](const std::string& path) {
    try {
      read_file(path);
    } catch (const std::filesystem::filesystem_error& error) {
      return error.code();
    }
    return std::error_code();
  };
  CHECK(error_of(pipe) == std::errc::invalid_argument);
  CHECK(error_of("/dev/zero") == std::errc::invalid_argument);
  CHECK(error_of(folder) == std::errc::is_a_directory);
  CHECK(error_of(large) == std::errc::file_too_large);
  CHECK(error_of(folder + "/none") == std::errc::no_such_file_or_directory);
}

TEST_CASE("a configuration file that is not there is reported as such") {
  CHECK_THROWS_AS(load_config({"no-such-config.toml", {}, {}}), std::filesystem::filesystem_error);
  CHECK_THROWS_AS(find_faults("no-such-config.toml"), std::filesystem::filesystem_error);
}

}  // namespace cradle
