// tests/scenes/README.md and the readers of scenes and configuration have the same keys, types and
// defaults: the test walks the tables of the document.
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "server/config_layers.h"
#include "server/dynamics/mass_distribution.h"
#include "tests/unit/scene_helpers.h"

namespace cradle {
namespace {

struct Key {
  std::string name, type, fallback, meaning;  // as the document has them; fallback: no backticks
};
/// By the heading above the table.
using Document = std::map<std::string, std::vector<Key>>;

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(' ');
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

std::string without_backticks(std::string text) {
  std::erase(text, '`');
  return text;
}

Document read_document() {
  std::ifstream stream(CRADLE_SCENE_DIR "/README.md");
  REQUIRE(stream);
  Document document;
  std::string line, heading;
  while (std::getline(stream, line)) {
    if (line.starts_with("#")) {
      heading = without_backticks(trimmed(line.substr(line.find_first_not_of('#'))));
    }
    if (!line.starts_with("| `")) continue;
    std::vector<std::string> cells;
    std::istringstream row(line.substr(1));
    for (std::string cell; std::getline(row, cell, '|');) cells.push_back(trimmed(cell));
    REQUIRE(cells.size() == 5);
    CHECK(!cells[4].empty());  // the meaning
    // Only what stands in backticks is a value; other words explain why there is none.
    const bool is_value = cells[3].starts_with("`");
    document[heading].push_back({without_backticks(cells[0]), cells[1],
                                 is_value ? without_backticks(cells[3]) : "", cells[4]});
  }
  return document;
}

/// What comes before the keys of a table: its parents, itself, and what it needs to be valid.
const std::map<std::string, std::string> kBefore = {
    {"[world]", "[world]\n"},
    {"[[body]]", "[[body]]\n"},
    {"[[body.part]]", "[[body]]\nshape = 'compound'\n[[body.part]]\n"},
    {"[[body.wrench]]", "[[body]]\nmass_kg = 1\n[[body.wrench]]\n"},
    {"[[spring]]", "[[body]]\nname = 'one'\nmass_kg = 1\n[[spring]]\n"},
    {"[[lattice]]", "[[lattice]]\n"},
};

std::string refusal_of_config(const std::string& text) {
  const auto path = std::filesystem::temp_directory_path() /
                    ("cradle-document-" + std::to_string(::getpid()) + ".toml");
  std::ofstream(path) << text;
  std::string refusal;
  for (std::string fault : find_faults(path.string())) {
    refusal += fault.replace(0, path.string().size(), "x.toml");
  }
  std::filesystem::remove(path);
  return refusal;
}

std::string refusal(const std::string& heading, const std::string& line) {
  return heading == "Configuration" ? refusal_of_config(line)
                                    : scene_refusal(kBefore.at(heading) + line);
}

/// The keys that the reader lists where it meets one that resembles none.
std::set<std::string> known_keys(const std::string& heading) {
  const std::string text = refusal(heading, "qqqqqqqqqqqqqqqqqqqqqqqq = 1");
  const std::string mark = "known here: ";
  REQUIRE_THAT(text, Catch::Matchers::Contains(mark));
  std::istringstream list(text.substr(text.find(mark) + mark.size()));
  std::set<std::string> keys;
  for (std::string key; std::getline(list, key, ',');) keys.insert(trimmed(key));
  return keys;
}

/// What the reader demands of a value of the document's type.
std::string demand(const std::string& type) {
  if (type == "number") return "must be a number";
  if (type == "integer") return "must be an integer";
  if (type == "string") return "must be a string";
  if (type == "bool") return "must be true or false";
  if (type == "tables") return "must be tables";
  return "must be " + type;  // "3 numbers"
}

bool is_same_scene(const Scene& a, const Scene& b) {
  const auto is_same_wrench = [](const TimedWrench& v, const TimedWrench& w) {
    return v.tick == w.tick && v.body == w.body && v.wrench == w.wrench;
  };
  // Of stored geometry only compounds matter here: their parts.
  const auto is_same_geometry = [](const GeometryPointer& g, const GeometryPointer& h) {
    const MassDistribution m = mass_distribution(*g, 1), n = mass_distribution(*h, 1);
    return m.mass_kg == n.mass_kg && m.p_BoBcm == n.p_BoBcm && m.G == n.G;
  };
  const auto is_same_spring = [](const SceneSpring& v, const SceneSpring& w) {
    return v.a == w.a && v.b == w.b && v.spring == w.spring;
  };
  return a.settings.rate_hz == b.settings.rate_hz && a.settings.sub_steps == b.settings.sub_steps &&
         a.settings.gravity_W == b.settings.gravity_W && a.settings.solver == b.settings.solver &&
         a.settings.scheme == b.settings.scheme &&
         a.settings.broad_phase == b.settings.broad_phase && a.bodies == b.bodies &&
         a.drags == b.drags &&
         std::equal(a.springs.begin(), a.springs.end(), b.springs.begin(), b.springs.end(),
                    is_same_spring) &&
         std::equal(a.geometries.begin(), a.geometries.end(), b.geometries.begin(),
                    b.geometries.end(), is_same_geometry) &&
         std::equal(a.wrenches.begin(), a.wrenches.end(), b.wrenches.begin(), b.wrenches.end(),
                    is_same_wrench);
}

}  // namespace

TEST_CASE("the document lists exactly the keys that the readers know") {
  const Document document = read_document();
  CHECK(document.size() == 7);
  for (const auto& [heading, keys] : document) {
    CAPTURE(heading);
    std::set<std::string> documented;
    for (const Key& key : keys) CHECK(documented.insert(key.name).second);
    CHECK(documented == known_keys(heading));
  }
}

TEST_CASE("every key demands the type that the document gives, and names its line") {
  for (const auto& [heading, keys] : read_document()) {
    for (const Key& key : keys) {
      CAPTURE(heading, key.name);
      // A date is a value of TOML that no key takes. Blank lines move the key to a line of its own.
      std::string before = heading == "[[lattice]]" ? "\n\n" : "";
      if (heading == "[[lattice]]" && key.name != "count") before += "count = [1, 1, 1]\n";
      if (heading == "[[lattice]]" && key.name != "pitch_m") before += "pitch_m = [1, 1, 1]\n";
      if (heading == "[[body]]" && key.name == "radius_m") before = "shape = 'sphere'\n";
      if (heading == "[[body]]" && key.name == "half_extents_m") before = "shape = 'box'\n";
      if (heading == "[[body]]" && key.name != "mass_kg") before += "mass_kg = 1\n";
      if (heading == "[[body.part]]" && key.name != "shape") before += "shape = 'hull'\n";
      const bool is_of_any_part = key.name == "density_kgpm3" || key.name == "position_m" ||
                                  key.name == "orientation_wxyz" || key.name == "rotation_rad";
      if (heading == "[[body.part]]" && is_of_any_part) before = "shape = 'sphere'\nradius_m = 1\n";
      if (heading == "[[spring]]" && key.name != "body_a") before += "body_a = 'one'\n";
      if (heading == "[[body.wrench]]" && key.name != "value") before += "value = [1, 0, 0]\n";
      const std::string all = heading == "Configuration" ? before : kBefore.at(heading) + before;
      const auto line = 1 + std::count(all.begin(), all.end(), '\n');
      CHECK_THAT(refusal(heading, before + key.name + " = 1979-05-27"),
                 Catch::Matchers::StartsWith("x.toml:" + std::to_string(line) + ": " + key.name +
                                             ": " + demand(key.type)));
    }
  }
}

TEST_CASE("every default of the document is what a scene without the key gets") {
  int defaults = 0;
  for (const auto& [heading, keys] : read_document()) {
    if (heading == "Configuration") continue;
    for (const Key& key : keys) {
      if (key.fallback.empty()) continue;
      CAPTURE(heading, key.name);
      std::string before = kBefore.at(heading), after;
      if (heading == "[[body]]") {
        before +=
            key.name == "density_kgpm3" ? "shape = 'sphere'\nradius_m = 1\n" : "mass_kg = 1\n";
      }
      if (heading == "[[body.part]]") before += "shape = 'sphere'\nradius_m = 1\n";
      if (heading == "[[body.wrench]]") before += "value = [1, 0, 0]\n";
      if (heading == "[[spring]]") before += "body_a = 'one'\n";
      if (heading == "[[lattice]]") {
        before += "count = [3, 3, 2]\npitch_m = [1, 1, 1]\n";
        if (key.name == "seed") before += "jitter_m = [1, 1, 1]\n";
        after = "[[lattice.body]]\nmass_kg = 1\n";
      }
      CHECK(is_same_scene(scene_of(before + key.name + " = " + key.fallback + "\n" + after),
                          scene_of(before + after)));
      ++defaults;
    }
  }
  CHECK(defaults > 20);  // or the table was not understood
}

TEST_CASE("the document marks what a reload takes over") {
  const Document document = read_document();
  for (const Setting& setting : all_settings()) {
    for (const Key& key : document.at("Configuration")) {
      if (key.name != setting.key) continue;
      CAPTURE(key.name);
      CHECK(key.meaning.ends_with("; *live*") == setting.is_reloadable);
    }
  }
}

TEST_CASE("every default of the document is what a configuration without the key gets") {
  std::map<std::string, std::string> expected;
  for (const Setting& setting : all_settings()) {
    expected[std::string(setting.key)] = value_text(setting, Config());
  }
  const Document document = read_document();
  for (const Key& key : document.at("Configuration")) {
    CAPTURE(key.name);
    REQUIRE(expected.contains(key.name));
    CHECK(key.fallback == expected.at(key.name));
  }
}

}  // namespace cradle
