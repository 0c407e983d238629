#include "server/toml_reader.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <numeric>
#include <sstream>

namespace cradle {
namespace {

std::string located(const TomlFile& file, const toml::source_region& where,
                    std::string_view reason) {
  return file.name + ":" + std::to_string(where.begin.line) + ": " + std::string(reason);
}

/// Keystrokes between two words (Levenshtein distance).
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

std::string unknown(std::string_view key, TomlKeys keys) {
  return "unknown key '" + std::string(key) + "'; " + advice(key, keys);
}

}  // namespace

std::string advice(std::string_view key, TomlKeys keys) {
  std::string_view nearest;
  std::size_t least = 1 + std::max<std::size_t>(2, key.size() / 3);
  std::string all;
  for (std::string_view known : keys) {
    const std::size_t d = known.starts_with(key) && !key.empty() ? 0 : distance(key, known);
    if (d < least) {
      nearest = known;
      least = d;
    }
    all += (all.empty() ? "" : ", ") + std::string(known);
  }
  return nearest.empty() ? "known here: " + all : "did you mean '" + std::string(nearest) + "'?";
}

std::multimap<int, std::string> take_unknown_keys(TomlFile& file, TomlKeys keys) {
  std::multimap<int, std::string> taken;
  for (auto entry = file.root.begin(); entry != file.root.end();) {
    const toml::key& key = entry->first;
    if (std::find(keys.begin(), keys.end(), key.str()) != keys.end()) {
      ++entry;
      continue;
    }
    taken.emplace(static_cast<int>(key.source().begin.line),
                  located(file, key.source(), unknown(key.str(), keys)));
    entry = file.root.erase(entry);
  }
  return taken;
}

TomlFile::TomlFile(std::string_view text, std::string file_name, Refuse refuse_file)
    : name(std::move(file_name)), refuse(refuse_file) {
  try {
    root = toml::parse(text, name);
  } catch (const toml::parse_error& error) {  // the library's, turned into the caller's
    refuse(located(*this, error.source(), error.description()));
  }
}

std::string read_file(const std::string& path) {
  constexpr std::size_t kPartBytes = std::size_t{64} << 10;
  const auto refuse = [&path](int error) {
    throw std::filesystem::filesystem_error("cannot be read", path,
                                            std::error_code(error, std::generic_category()));
  };
  // A running world reads files, too: none that never ends, or that one waits for.
  std::error_code fault;
  const auto status = std::filesystem::status(path, fault);
  if (fault && fault != std::errc::no_such_file_or_directory) refuse(fault.value());
  if (std::filesystem::is_directory(status)) refuse(EISDIR);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) refuse(EINVAL);
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream) refuse(errno);
  std::string text, part(kPartBytes, 0);
  do {
    stream.read(part.data(), static_cast<std::streamsize>(part.size()));
    text.append(part, 0, static_cast<std::size_t>(stream.gcount()));
    if (text.size() > kFileBytesMax) refuse(EFBIG);
  } while (stream);
  return text;
}

TomlTable::TomlTable(const TomlFile& file, const toml::table& table, TomlKeys keys)
    : file_(&file), table_(&table), keys_(keys) {
  const toml::key* first = nullptr;
  for (const auto& [key, value] : table) {
    if (std::find(keys.begin(), keys.end(), key.str()) != keys.end()) continue;
    if (!first || key.source().begin < first->source().begin) first = &key;
  }
  if (!first) return;
  refuse_at(first->source(), unknown(first->str(), keys));
}

int TomlTable::line(std::string_view key) const {
  return static_cast<int>(node(key)->source().begin.line);
}

bool TomlTable::read(std::string_view key, bool& target) const {
  const toml::node* found = node(key);
  if (!found) return false;
  if (!found->is_boolean()) refuse_type(key, *found, "true or false");
  target = found->as_boolean()->get();
  return true;
}

bool TomlTable::read(std::string_view key, std::string& target) const {
  const toml::node* found = node(key);
  if (!found) return false;
  if (!found->is_string()) refuse_type(key, *found, "a string");
  target = found->as_string()->get();
  return true;
}

bool TomlTable::read(std::string_view key, std::int64_t& target) const {
  const toml::node* found = node(key);
  if (!found) return false;
  if (!found->is_integer()) refuse_type(key, *found, "an integer");
  target = found->as_integer()->get();
  return true;
}

bool TomlTable::read(std::string_view key, int& target) const {
  std::int64_t wide = 0;
  if (!read(key, wide)) return false;
  if (wide < std::numeric_limits<int>::min() || wide > std::numeric_limits<int>::max()) {
    refuse(key, "out of range");
  }
  target = static_cast<int>(wide);
  return true;
}

bool TomlTable::read(std::string_view key, double& target) const {
  const toml::node* found = node(key);
  if (!found) return false;
  const auto number = found->is_number() ? found->value<double>() : std::nullopt;
  if (!number) refuse_type(key, *found, "a number");
  target = *number;
  return true;
}

bool TomlTable::read(std::string_view key, std::span<std::int64_t> target) const {
  const toml::array* found = array(key, target.size(), "integers");
  if (!found) return false;
  for (std::size_t i = 0; i < target.size(); ++i) {
    const toml::node& item = (*found)[i];
    if (!item.is_integer()) refuse_type(key, item, "integers");
    target[i] = item.as_integer()->get();
  }
  return true;
}

bool TomlTable::read(std::string_view key, std::span<double> target) const {
  const toml::array* found = array(key, target.size(), "numbers");
  if (!found) return false;
  for (std::size_t i = 0; i < target.size(); ++i) {
    const toml::node& item = (*found)[i];
    const auto number = item.is_number() ? item.value<double>() : std::nullopt;
    if (!number) refuse_type(key, item, "numbers");
    target[i] = *number;
  }
  return true;
}

template <class Number, class Take>
bool TomlTable::read_triples(std::string_view key, const std::string& wanted, Take&& take,
                             std::vector<std::array<Number, 3>>& target) const {
  const toml::node* found = node(key);
  if (!found) return false;
  if (!found->is_array()) refuse_type(key, *found, wanted);
  target.clear();
  for (const toml::node& item : *found->as_array()) {
    const toml::array* triple = item.as_array();
    if (!triple) refuse_type(key, item, wanted);
    if (triple->size() != 3) refuse_at(item.source(), std::string(key) + ": must be " + wanted);
    std::array<Number, 3>& numbers = target.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto number = take((*triple)[k]);
      if (!number) refuse_type(key, (*triple)[k], wanted);
      numbers[k] = *number;
    }
  }
  return true;
}

bool TomlTable::read(std::string_view key, std::vector<std::array<double, 3>>& target) const {
  const auto take = [](const toml::node& item) {
    return item.is_number() ? item.value<double>() : std::nullopt;
  };
  return read_triples(key, "lists of 3 numbers", take, target);
}

bool TomlTable::read(std::string_view key, std::vector<std::array<std::int64_t, 3>>& target) const {
  const auto take = [](const toml::node& item) {
    return item.is_integer() ? std::optional(item.as_integer()->get()) : std::nullopt;
  };
  return read_triples(key, "lists of 3 integers", take, target);
}
bool TomlTable::read(std::string_view key, std::vector<std::vector<double>>& target) const {
  const toml::node* found = node(key);
  if (!found) return false;
  const std::string wanted = "lists of numbers";
  if (!found->is_array()) refuse_type(key, *found, wanted);
  target.clear();
  for (const toml::node& item : *found->as_array()) {
    const toml::array* row = item.as_array();
    if (!row) refuse_type(key, item, wanted);
    std::vector<double>& numbers = target.emplace_back();
    for (const toml::node& number : *row) {
      const std::optional<double> value = number.value<double>();
      if (!value) refuse_type(key, number, wanted);
      numbers.push_back(*value);
    }
  }
  return true;
}

bool TomlTable::read(std::string_view key, Vec3& target) const {
  std::array<double, 3> v{};
  if (!read(key, v)) return false;
  target = {v[0], v[1], v[2]};
  return true;
}

bool TomlTable::read(std::string_view key, Quat& target) const {
  std::array<double, 4> q{};
  if (!read(key, q)) return false;
  target = {q[0], q[1], q[2], q[3]};
  return true;
}

std::optional<TomlTable> TomlTable::table(std::string_view key, TomlKeys keys) const {
  const toml::node* found = node(key);
  if (!found) return std::nullopt;
  if (!found->is_table()) refuse_type(key, *found, "a table, [" + std::string(key) + "]");
  return TomlTable(*file_, *found->as_table(), keys);
}

std::vector<TomlTable> TomlTable::tables(std::string_view key, TomlKeys keys) const {
  std::vector<TomlTable> result;
  const toml::node* found = node(key);
  if (!found) return result;
  const std::string wanted = "tables, [[" + std::string(key) + "]]";
  if (!found->is_array()) refuse_type(key, *found, wanted);
  for (const toml::node& item : *found->as_array()) {
    if (!item.is_table()) refuse_type(key, item, wanted);
    result.push_back(TomlTable(*file_, *item.as_table(), keys).about(subject_));
  }
  return result;
}

void TomlTable::refuse(std::string_view key, const std::string& reason) const {
  const toml::node* found = node(key);
  refuse_at(found ? found->source() : table_->source(), std::string(key) + ": " + reason);
}

void TomlTable::refuse(const std::string& reason) const { refuse_at(table_->source(), reason); }

const toml::node* TomlTable::node(std::string_view key) const {
  assert(std::find(keys_.begin(), keys_.end(), key) != keys_.end());
  return table_->get(key);
}

const toml::array* TomlTable::array(std::string_view key, std::size_t size,
                                    const std::string& wanted) const {
  const toml::node* found = node(key);
  if (!found) return nullptr;
  const std::string counted = std::to_string(size) + " " + wanted;
  if (!found->is_array()) refuse_type(key, *found, counted);
  if (found->as_array()->size() != size) refuse(key, "must be " + counted);
  return found->as_array();
}

void TomlTable::refuse_type(std::string_view key, const toml::node& found,
                            const std::string& wanted) const {
  std::ostringstream type;
  type << found.type();
  refuse_at(found.source(),
            std::string(key) + ": must be " + wanted + ", not of type " + type.str());
}

void TomlTable::refuse_at(const toml::source_region& where, const std::string& reason) const {
  file_->refuse(located(*file_, where, subject_.empty() ? reason : reason + " (" + subject_ + ")"));
  std::abort();  // a Refuse does not return
}

}  // namespace cradle
