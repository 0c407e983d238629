// What configuration files say, and how wrong ones are refused. Keys: tests/scenes/README.md.
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "server/config.h"

namespace cradle {
namespace {

/// A configuration file in a folder of its own, for as long as the object lives.
class ConfigFile {
 public:
  explicit ConfigFile(const std::string& text) {
    std::string folder = (std::filesystem::temp_directory_path() / "cradle-XXXXXX").string();
    REQUIRE(::mkdtemp(folder.data()));
    folder_ = folder;
    std::ofstream(path()) << text;
  }
  ~ConfigFile() { std::filesystem::remove_all(folder_); }
  ConfigFile(const ConfigFile&) = delete;
  ConfigFile& operator=(const ConfigFile&) = delete;

  std::filesystem::path folder() const { return folder_; }
  std::string path() const { return (folder_ / "cradled.toml").string(); }

 private:
  std::filesystem::path folder_;
};

/// Why a file of this text is refused, without its folder; empty if it is not.
std::string refusal(const std::string& text) {
  const ConfigFile file(text);
  try {
    load_config(file.path());
  } catch (const ConfigError& error) {
    return std::string(error.what()).substr(file.folder().string().size() + 1);
  }
  return {};
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
bodies_max = 7
wrenches_max = 8
log_level = "debug"
)");
  const Config config = load_config(file.path());
  CHECK(config.world == "arena-2");
  CHECK(config.lcm_url == "udpm://239.1.2.3:8000?ttl=1");
  CHECK(config.rate_hz == 120);
  CHECK(config.scene == (file.folder() / "scenes/a.toml").string());
  CHECK(config.lockstep);
  CHECK(!config.allow_control);
  CHECK(config.allow_shutdown);
  CHECK(config.datagram_bytes == 1400);
  CHECK(config.threads == 2);
  CHECK(config.bodies_max == 7);
  CHECK(config.wrenches_max == 8);
  CHECK(config.log_level == "debug");
}

TEST_CASE("a scene's absolute path stays, and no scene stays none") {
  CHECK(load_config(ConfigFile("scene = '/some/where.toml'").path()).scene == "/some/where.toml");
  CHECK(load_config(ConfigFile("").path()).scene.empty());
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
      {"bodies_max = -1", "cradled.toml:1: bodies_max: must be 0 to 1000000"},
      {"wrenches_max = 1000001", "cradled.toml:1: wrenches_max: must be 0 to 1000000"},
      {"threads = 257", "cradled.toml:1: threads: must be 1 to 256"},
      {"log_level = 'loud'", "cradled.toml:1: log_level: \"loud\" is none of trace, debug, info"},
  };
  for (const Case& c : cases) {
    CAPTURE(c.text);
    CHECK_THAT(refusal(c.text), Catch::Matchers::StartsWith(c.refusal));
  }
}

TEST_CASE("values at the limits of a configuration are accepted") {
  for (const std::string text :
       {"rate_hz = 1", "rate_hz = 10000", "datagram_bytes = 512", "datagram_bytes = 60000",
        "threads = 256", "log_level = 'off'", "world = 'abcdefghijklmnopqrstuvwx'"}) {
    CHECK(refusal(text) == "");
  }
}

TEST_CASE("a configuration file that is not there is reported as such") {
  CHECK_THROWS_AS(load_config("no-such-config.toml"), std::filesystem::filesystem_error);
}

}  // namespace cradle
