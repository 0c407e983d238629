// The real `cradled` on the command line: what simulate writes, and how all of it fails.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include "tests/integration/process.h"

namespace cradle {
namespace {

std::string scene(const std::string& name) { return CRADLE_SCENE_DIR "/" + name; }

Finished run_simulate(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"cradled", "simulate"});
  return run(arguments);
}

/// The run's summary, after it went well.
std::string summary_of(std::vector<std::string> arguments) {
  arguments.insert(arguments.end(), {"--summary", "-"});
  const Finished finished = run_simulate(arguments);
  REQUIRE(finished.exit_code == 0);
  REQUIRE(finished.errors.empty());
  return finished.output;
}

/// The text of one value of a flat JSON object.
std::string json_value(const std::string& json, const std::string& key) {
  std::smatch match;
  const std::regex pattern("\"" + key + "\": (\"[^\"]*\"|\\[[^\\]]*\\]|[^,\\n]*)");
  REQUIRE(std::regex_search(json, match, pattern));
  return match[1];
}
double json_number(const std::string& json, const std::string& key) {
  return std::stod(json_value(json, key));
}

using Rows = std::vector<std::vector<std::string>>;
Rows rows_of(const std::string& csv) {
  Rows rows;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

std::string trace_text(const std::filesystem::path& path) {
  std::ifstream stream(path);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// A folder for one test, gone after it.
struct TraceFolder {
  ~TraceFolder() { std::filesystem::remove_all(path); }
  std::filesystem::path path = new_folder();
};

}  // namespace

TEST_CASE("a trace has a row a body and tick, under name or id, and follows the closed form") {
  const Finished finished =
      run_simulate({scene("free_fall.toml"), "--duration", "0.5", "--trace", "-"});
  REQUIRE(finished.exit_code == 0);
  CHECK(finished.errors.empty());
  const Rows rows = rows_of(finished.output);
  REQUIRE(rows.size() == 1 + 2 * 51);  // header, the start, and 50 ticks of 1/100 s
  CHECK(rows[0] == Rows::value_type{"tick", "time_s", "body", "x", "y", "z", "qw", "qx", "qy", "qz",
                                    "vx", "vy", "vz", "wx", "wy", "wz"});
  for (std::size_t n = 1; n < rows.size(); n += 2) {
    const auto number = [&](std::size_t row, std::size_t column) {
      return std::stod(rows[row][column]);
    };
    const double t = static_cast<double>(n / 2) / 100;
    CAPTURE(t);
    CHECK(number(n, 0) == static_cast<double>(n / 2));
    CHECK(number(n, 1) == Approx(t));
    CHECK(rows[n][2] == "stone");
    CHECK(rows[n + 1][2] == "2");
    // Free fall: z = 100 - g t^2 / 2; the thrown box: r0 + v0 t - g t^2 / 2.
    const double fall = 9.81 * t * t / 2;
    CHECK(number(n, 5) == Approx(100 - fall).epsilon(1e-12));
    CHECK(number(n, 12) == Approx(-9.81 * t).margin(1e-12));
    CHECK(number(n + 1, 3) == Approx(10 + 1 * t).epsilon(1e-12));
    CHECK(number(n + 1, 4) == Approx(2 * t).margin(1e-12));
    CHECK(number(n + 1, 5) == Approx(100 + 3 * t - fall).epsilon(1e-12));
    // Spin about a principal axis stays: the angle is 4 rad/s t, half of it in the quaternion.
    CHECK(number(n + 1, 6) == Approx(std::cos(2 * t)).margin(1e-9));
    CHECK(number(n + 1, 9) == Approx(std::sin(2 * t)).margin(1e-9));
    CHECK(number(n + 1, 15) == Approx(4).epsilon(1e-12));
  }
}

TEST_CASE("a summary tells how many ticks looked for contacts twice") {
  const std::string falls = summary_of({scene("tumble.toml"), "--duration", "3"});
  CHECK(json_number(falls, "ticks_in_halves") > 60);  // about a second is nothing but flight
  CHECK(json_number(falls, "ticks_in_halves") < 180);
  CHECK(json_number(summary_of({scene("pile.toml"), "--duration", "0.5"}), "ticks_in_halves") == 0);
}

TEST_CASE("a summary has every figure of the run") {
  const std::string json = summary_of({scene("stack.toml"), "--duration", "0.5"});
  const std::string plain = summary_of({scene("stack.toml"), "--duration", "0.5"});
  CHECK(json_value(json, "scene") == '"' + scene("stack.toml") + '"');
  CHECK(json_value(json, "version") == "\"0.1.0\"");
  CHECK(json_value(json, "solver") == "\"hybrid\"");
  CHECK(json_number(json, "dt_s") == 1.0 / 60);
  CHECK(json_number(json, "sub_steps") == 0);  // as many as the tolerance asks for
  CHECK(json_number(json, "contact_tolerance_m") == 0.0005);
  // They lie there from the start: solved at once.
  CHECK(json_number(json, "sub_steps_max") == 1);
  CHECK(json_number(json, "sag_expected_m") > 1e-9);
  CHECK(json_number(json, "sag_expected_m") < 1e-8);
  const std::string soft =
      summary_of({scene("stack.toml"), "--duration", "0.5", "--solver", "soft"});
  CHECK(json_number(soft, "sub_steps_max") >= 4);
  // The lowest contact carries ten cubes, at most half a millimetre deep, and nothing flies.
  CHECK(json_number(soft, "sag_expected_m") > 0.0002);
  CHECK(json_number(soft, "sag_expected_m") < 0.0005);
  CHECK(json_number(json, "impacts") == 0);
  CHECK(json_number(json, "threads") == 1);
  CHECK(json_number(json, "ticks") == 30);
  CHECK(json_number(json, "bodies") == 11);
  CHECK(json_number(json, "quarantined") == 0);
  CHECK(json_number(json, "contacts") == 40);  // four under each of ten cubes
  CHECK(json_number(json, "asleep") == 0);     // not yet
  const std::string later = summary_of({scene("stack.toml"), "--duration", "2"});
  CHECK(json_number(later, "asleep") == 10);
  CHECK(json_number(later, "contacts") == 0);  // sleepers' are not counted
  CHECK(json_number(json, "wall_time_s") > 0);
  CHECK(json_number(json, "us_per_tick_mean") > 0);
  CHECK(json_number(json, "us_per_tick_median") <= json_number(json, "us_per_tick_p99"));
  CHECK(json_number(json, "penetration_max_m") >= json_number(json, "penetration_mean_m"));
  // Ten cubes of 1 kg at heights 0.5 .. 9.5, less some sag: m g times 50 m.
  CHECK(json_number(json, "potential_energy_J") == Approx(9.81 * 50).epsilon(0.01));
  CHECK(json_number(json, "energy_J") ==
        json_number(json, "kinetic_energy_J") + json_number(json, "potential_energy_J"));
  for (const char* key : {"momentum_Ns", "angular_momentum_Nms"}) {
    CHECK(std::regex_match(json_value(json, key), std::regex("\\[[^,]+, [^,]+, [^,]+\\]")));
  }
  CHECK(std::regex_match(json_value(json, "hash"), std::regex("\"[0-9a-f]{16}\"")));
}

TEST_CASE("two runs of a scene give the same hash and the same trace, with one thread or two") {
  const std::vector<std::string> arguments = {scene("demo.toml"), "--duration", "2"};
  const std::string first = json_value(summary_of(arguments), "hash");
  CHECK(json_value(summary_of(arguments), "hash") == first);
  auto two_threads = arguments;
  two_threads.insert(two_threads.end(), {"--threads", "2"});
  CHECK(json_value(summary_of(two_threads), "hash") == first);
  auto other = arguments;
  other.insert(other.end(), {"--substeps", "5"});
  CHECK(json_value(summary_of(other), "hash") != first);

  auto traced = arguments;
  traced.insert(traced.end(), {"--trace", "-"});
  CHECK(run_simulate(traced).output == run_simulate(traced).output);
}

TEST_CASE(
    "the flags --dt and --substeps stand instead of the scene's, and a duration is whole ticks") {
  const std::string json = summary_of(
      {scene("free_fall.toml"), "--duration", "0.999", "--dt", "0.02", "--substeps", "8"});
  CHECK(json_number(json, "dt_s") == 0.02);
  CHECK(json_number(json, "sub_steps") == 8);
  CHECK(json_number(json, "contact_tolerance_m") == 0);
  CHECK(json_number(json, "ticks") == 50);
}

TEST_CASE("the flag --solver stands instead of the scene's, and what it could not do is counted") {
  const std::string json =
      summary_of({scene("stack.toml"), "--duration", "0.1", "--solver", "lcp"});
  CHECK(json_value(json, "solver") == "\"lcp\"");
  const std::string heap =
      summary_of({scene("bench_stack.toml"), "--duration", "0.1", "--solver", "lcp"});
  CHECK(json_number(heap, "islands_makeshift") == 6);  // twenty cubes, in each tick
  const std::string plain = summary_of({scene("stack.toml"), "--duration", "0.1"});
  CHECK(json_value(plain, "solver") == "\"hybrid\"");
  CHECK(json_number(plain, "islands_makeshift") == 0);
}

TEST_CASE("trace and summary go to files, and the summary to standard output by default") {
  const TraceFolder folder;
  const std::string trace = (folder.path / "trace.csv").string();
  const std::string summary = (folder.path / "summary.json").string();
  const Finished silent = run_simulate(
      {scene("free_fall.toml"), "--duration", "0.1", "--trace", trace, "--summary", summary});
  CHECK(silent.exit_code == 0);
  CHECK(silent.output.empty());
  CHECK(rows_of(trace_text(trace)).size() == 1 + 2 * 11);
  CHECK(json_number(trace_text(summary), "ticks") == 10);

  const Finished plain = run_simulate({scene("free_fall.toml"), "--duration", "0.1"});
  CHECK(json_number(plain.output, "ticks") == 10);
}

TEST_CASE("whatever is wrong with a command line or its files is one line and an exit code") {
  const TraceFolder folder;
  const std::string bad_scene = (folder.path / "bad.toml").string();
  std::ofstream(bad_scene) << "[world]\nrate_hz = -1\n";
  const std::string empty = scene("empty.toml");
  struct Case {
    std::vector<std::string> arguments;
    int exit_code;
    std::string part;  // of the line
  };
  const std::vector<Case> cases = {
      {{"cradled"}, 64, "subcommand"},
      {{"cradled", "fly"}, 64, ""},
      {{"cradled", "simulate"}, 64, "SCENE"},
      {{"cradled", "simulate", empty}, 64, "--duration"},
      {{"cradled", "simulate", empty, "--duration", "soon"}, 64, "--duration"},
      {{"cradled", "simulate", empty, "--duration", "0"}, 64, "--duration"},
      {{"cradled", "simulate", empty, "--duration", "nan"}, 64, "--duration"},
      {{"cradled", "simulate", empty, "--duration", "1", "--dt", "2"}, 64, "--dt"},
      {{"cradled", "simulate", empty, "--duration", "1", "--dt", "0"}, 64, "--dt"},
      {{"cradled", "simulate", empty, "--duration", "1", "--substeps", "65"}, 64, "--substeps"},
      {{"cradled", "simulate", empty, "--duration", "1", "--solver", "none"}, 64, "--solver"},
      {{"cradled", "simulate", empty, "--duration", "1", "--threads", "0"}, 64, "--threads"},
      {{"cradled", "simulate", empty, "--duration", "1", "--trace", "-", "--summary", "-"},
       64,
       "standard output"},
      {{"cradled", "simulate", bad_scene, "--duration", "1"}, 65, bad_scene + ":2: rate_hz: out"},
      {{"cradled", "simulate", "no.toml", "--duration", "1"}, 66, "no.toml: No such file"},
      {{"cradled", "simulate", CRADLE_SCENE_DIR, "--duration", "1"}, 66, "Is a directory"},
      {{"cradled", "simulate", empty, "--duration", "1", "--trace", "/no/folder"},
       73,
       "/no/folder"},
      {{"cradled", "simulate", empty, "--duration", "1", "--summary", "/dev/full"},
       73,
       "/dev/full: No space left"},
      {{"cradled", "serve", "--world", "a.b"}, 64, "world: \"a.b\" is not"},
      {{"cradled", "serve", "--rate", "0.5", "--lcm-url", own_url()}, 64, "--rate: must be"},
      {{"cradled", "serve", "--threads", "two"}, 64, "--threads: must be an integer"},
      {{"cradled", "serve", "--lockstep=perhaps"}, 64, "--lockstep: must be true or false"},
      {{"cradled", "serve", "--wrold", "a"}, 64, "--wrold"},
      {{"cradled", "serve", "--config", ""}, 66, "No such file"},
      {{"cradled", "print-config", "--config", bad_scene}, 78, bad_scene + ":1: world: must be"},
      {{"cradled", "print-config", "--threads", "0"}, 64, "--threads: must be 1 to 256"},
      {{"cradled", "check"}, 64, "FILE"},
      {{"cradled", "check", "no.toml"}, 66, "no.toml: No such file"},
      {{"cradled", "serve", "--config", bad_scene}, 78, bad_scene + ":1: world: must be"},
      {{"cradled", "serve", "--scene", bad_scene, "--lcm-url", own_url()}, 65, bad_scene + ":2: "},
  };
  for (const Case& c : cases) {
    std::string all;
    for (const std::string& argument : c.arguments) all += argument + " ";
    CAPTURE(all);
    const Finished finished = run(c.arguments);
    CHECK(finished.exit_code == c.exit_code);
    CHECK(finished.output.empty());
    CHECK(line_count(finished.errors) == 1);
    CHECK_THAT(finished.errors, Catch::Matchers::StartsWith("cradled: "));
    CHECK_THAT(finished.errors, Catch::Matchers::Contains(c.part));
  }
}

TEST_CASE("the flag --help lists every exit code and the flag --version the protocol's version") {
  for (const std::vector<std::string>& help : std::vector<std::vector<std::string>>{
           {"cradled", "--help"}, {"cradled", "serve", "--help"}, {"cradled", "simulate", "-h"}}) {
    const Finished finished = run(help);
    CHECK(finished.exit_code == 0);
    CHECK(finished.errors.empty());
    for (const char* code : {"0 ", "64 ", "65 ", "66 ", "69 ", "70 ", "73 ", "78 "}) {
      CHECK_THAT(finished.output, Catch::Matchers::Contains(code));
    }
  }
  CHECK(run({"cradled", "--version"}).output == "cradled 0.1.0, protocol 2\n");
}

TEST_CASE("the flag --print-limits prints every limit of limits.h") {
  const Finished finished = run({"cradled", "serve", "--print-limits"});
  CHECK(finished.exit_code == 0);
  const std::string header = trace_text(CRADLE_SOURCE_DIR "/protocol/include/cradle/limits.h");
  const std::regex constant("constexpr [a-z_:0-9]+ (k[A-Za-z0-9_]+) =");
  int limits = 0;
  for (std::sregex_iterator it(header.begin(), header.end(), constant), end; it != end; ++it) {
    CHECK_THAT(finished.output, Catch::Matchers::Contains((*it)[1].str() + " "));
    ++limits;
  }
  CHECK(limits == line_count(finished.output));
  CHECK(limits > 20);  // or the pattern found nothing
}

TEST_CASE("the hash is the same where libm may not use what this machine has") {
  // glibc picks sin, cos, exp by the machine; a step that called one would have other bits
  // elsewhere.
  const std::vector<std::string> tail{"simulate", scene("demo.toml"), "--duration",
                                      "1",        "--summary",        "-"};
  std::vector<std::string> plain{"cradled"};
  std::vector<std::string> masked{"/usr/bin/env",
                                  "GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2,-AVX2_Usable",
                                  CRADLE_BIN_DIR "/cradled"};
  plain.insert(plain.end(), tail.begin(), tail.end());
  masked.insert(masked.end(), tail.begin(), tail.end());
  const Finished here = run(plain);
  const Finished elsewhere = run(masked);
  REQUIRE(here.exit_code == 0);
  REQUIRE(elsewhere.exit_code == 0);
  CHECK(json_value(here.output, "hash") == json_value(elsewhere.output, "hash"));
}

}  // namespace cradle
