#include "server/config_layers.h"

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <filesystem>
#include <map>
#include <ostream>

#include "protocol/transport/lcm_url.h"
#include "server/simulate.h"
#include "server/toml_reader.h"

namespace cradle {
namespace {

namespace fs = std::filesystem;

/// Variables of ours that are no keys: the build folder of the scripts (server/network.sh).
constexpr std::string_view kOtherVariables[] = {"CRADLE_BUILD"};

using Faults = std::multimap<int, std::string>;  // by line

std::vector<std::string_view> all_keys() {
  std::vector<std::string_view> keys;
  for (const Setting& setting : all_settings()) keys.push_back(setting.key);
  return keys;
}

bool is_parsed(const std::string& text, bool& value) {
  value = text == "true";
  return value || text == "false";
}
bool is_parsed(const std::string& text, std::string& value) {
  value = text;
  return true;
}
template <class Number>
bool is_parsed(const std::string& text, Number& value) {
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && stop == end;
}

const char* wanted(const bool&) { return "true or false"; }
const char* wanted(const int&) { return "an integer"; }
const char* wanted(const double&) { return "a number"; }
const char* wanted(const std::string&) { return "a string"; }

/// Sets from a text of the environment or the command line; what is wrong with it, or empty.
std::string set_text(const Setting& setting, const std::string& text, Config& values) {
  const std::string fault = std::visit(
      [&](auto field) -> std::string {
        if (is_parsed(text, values.*field)) return {};
        return std::string("must be ") + wanted(values.*field) + ", not \"" + text + '"';
      },
      setting.field);
  return fault.empty() && setting.fault ? setting.fault(values) : fault;
}

/// The setting's path, if it is one and not empty.
std::string* path_in(Config& values, const Setting& setting) {
  if (!setting.is_path) return nullptr;
  std::string& path = values.*std::get<std::string Config::*>(setting.field);
  return path.empty() ? nullptr : &path;
}

/// Sets what the file says; every key and value that is wrong, and not set. Refuses what is not
/// TOML.
Faults add_file(const std::string& path, LoadedConfig& config) {
  TomlFile file(read_file(path), path, refuse_with<ConfigError>);
  const auto keys = all_keys();
  const bool is_scene = file.root.contains("body") || file.root.contains("lattice");
  Faults faults = take_unknown_keys(file, keys);
  if (is_scene) {
    faults.emplace(0, path + ": is a scene, not a configuration: try cradled explain " + path);
  }
  const TomlTable table(file, keys);
  for (const Setting& setting : all_settings()) {
    if (!table.has(setting.key)) continue;
    Config values = config.values;
    try {  // every fault is wanted, not the first
      std::visit([&](auto field) { table.read(setting.key, values.*field); }, setting.field);
      const std::string fault = setting.fault ? setting.fault(values) : "";
      if (!fault.empty()) table.refuse(setting.key, fault);
    } catch (const ConfigError& error) {
      faults.emplace(table.line(setting.key), error.what());
      continue;
    }
    if (std::string* found = path_in(values, setting)) {
      *found = (fs::path(path).parent_path() / *found).string();
    }
    config.values = values;
    config.origins.at(setting.key) = {path, table.line(setting.key)};
  }
  return faults;
}

const Setting* setting_of_variable(std::string_view name) {
  for (const Setting& setting : all_settings()) {
    if (setting.variable() == name) return &setting;
  }
  return nullptr;
}

[[noreturn]] void refuse_variable(const std::string& name) {
  std::vector<std::string> variables;
  for (const Setting& setting : all_settings()) variables.push_back(setting.variable());
  std::string word = name;
  for (char& c : word) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  throw ConfigError(
      name + ": unknown variable of the environment; " +
      advice(word, std::vector<std::string_view>(variables.begin(), variables.end())));
}

void add_environment(const NamedTexts& environment, LoadedConfig& config) {
  for (const auto& [name, text] : environment) {
    const bool is_ours = name.starts_with("CRADLE_");
    if (!is_ours || std::ranges::find(kOtherVariables, name) != std::end(kOtherVariables)) continue;
    const Setting* setting = setting_of_variable(name);
    if (setting == nullptr) refuse_variable(name);
    const std::string fault = set_text(*setting, text, config.values);
    if (!fault.empty()) throw ConfigError(name + ": " + fault);
    config.origins.at(setting->key) = {name};
  }
}

void add_flags(const NamedTexts& flags, LoadedConfig& config) {
  for (const Setting& setting : all_settings()) {
    for (const auto& [flag, text] : flags) {
      if (setting.flag() != flag) continue;
      const std::string fault = set_text(setting, text, config.values);
      if (!fault.empty()) throw ConfigError(flag + ": " + fault, kExitUsage);
      config.origins.at(setting.key) = {flag};
    }
  }
}

/// What is wrong with the scene that a configuration names; empty: nothing.
std::string scene_fault(const Config& config) {
  try {
    SceneRun run(first_scene(config));
  } catch (const SceneError& error) {
    return error.what();
  } catch (const fs::filesystem_error& error) {
    return error.path1().string() + ": " + error.code().message();
  }
  return {};
}

}  // namespace

NamedTexts process_environment() {
  NamedTexts all;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string text = *entry;
    const std::size_t equals = std::min(text.find('='), text.size());
    all.emplace_back(text.substr(0, equals), text.substr(std::min(equals + 1, text.size())));
  }
  return all;
}

LoadedConfig::LoadedConfig() {
  for (const Setting& setting : all_settings()) origins[setting.key] = {};
}

LoadedConfig load_config(const ConfigSources& sources) {
  LoadedConfig config;
  std::optional<std::string> file = sources.file;
  if (!file && fs::exists(kDefaultConfigFile)) file = kDefaultConfigFile;
  const Faults faults = file ? add_file(*file, config) : Faults();
  if (!faults.empty()) {
    std::string more;
    if (faults.size() > 1)
      more = " (cradled check tells all " + std::to_string(faults.size()) + ")";
    throw ConfigError(faults.begin()->second + more);
  }
  add_environment(sources.environment, config);
  add_flags(sources.flags, config);
  return config;
}

std::vector<std::string> find_faults(const std::string& file) {
  LoadedConfig config;
  Faults faults;
  try {
    faults = add_file(file, config);
  } catch (const ConfigError& error) {  // its syntax: nothing else can be said
    return {error.what()};
  }
  const std::string fault = scene_fault(config.values);
  const Origin& origin = config.origins.at("scene");
  if (!fault.empty()) faults.emplace(origin.line, origin.text() + ": scene: " + fault);
  std::vector<std::string> texts;
  for (const auto& [line, text] : faults) texts.push_back(text);
  return texts;
}

/// What a value that leaves the choice to us comes to.
std::string meaning(std::string_view key, const Config& config) {
  const LcmUrl url = *parse_lcm_url(config.lcm_url);
  if (key == "lcm_url" && config.lcm_url.empty()) return ": " + url.text();
  if (key == "rate_hz" && config.rate_hz == 0) return ": as the scene says";
  if (key == "datagram_bytes" && config.datagram_bytes == 0) {
    return ": " + std::to_string(default_datagram_bytes(url));
  }
  return "";
}

void print_config(std::ostream& out, const LoadedConfig& config) {
  Config values = config.values;
  for (const Setting& setting : all_settings()) {
    // Whoever reads it may do so from another folder.
    if (std::string* path = path_in(values, setting)) *path = fs::absolute(*path).string();
    std::string origin = config.origins.at(setting.key).text();
    for (char& c : origin) {  // no comment may have these
      if (std::iscntrl(static_cast<unsigned char>(c)) != 0) c = '?';
    }
    out << setting.key << " = " << value_text(setting, values) << "  # " << origin
        << meaning(setting.key, values) << '\n';
  }
}

}  // namespace cradle
