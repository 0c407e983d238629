/// Reads one TOML table key by key and refuses what is wrong with "FILE:LINE: reason".
///
/// A table knows its keys beforehand, so that a misspelt key is what gets reported, and not what
/// is missing because of it. Tables are views into a TomlFile, which must outlive them.
#pragma once

#include <cradle/types.h>
#include <toml++/toml.h>

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cradle {

/// Throws the reader's own error with this text; does not return.
using Refuse = void (*)(const std::string& text);

template <class Error>
[[noreturn]] void refuse_with(const std::string& text) {
  throw Error(text);
}

using TomlKeys = std::span<const std::string_view>;

/// What each enumerator is called in files.
template <class E>
using TomlNames = std::span<const std::pair<std::string_view, E>>;

/// One parsed file.
struct TomlFile {
  /// `name` is what the file is called in errors. Refuses what is not TOML.
  TomlFile(std::string_view text, std::string name, Refuse refuse);

  std::string name;
  Refuse refuse;
  toml::table root;
};

/// What the writer of an unknown key may have meant, as the end of a sentence: the key without its
/// unit, or a slip, or all that there are.
std::string advice(std::string_view key, TomlKeys keys);

/// Removes the keys of the file's root that are not among `keys`: "FILE:LINE: reason" for each, by
/// line. For readers that want every fault; a TomlTable refuses the first.
std::multimap<int, std::string> take_unknown_keys(TomlFile& file, TomlKeys keys);

inline constexpr std::size_t kFileBytesMax = std::size_t{64} << 20;

/// The whole of a regular file. Throws std::filesystem::filesystem_error if it cannot be read, is
/// no file, or has more than kFileBytesMax.
std::string read_file(const std::string& path);

class TomlTable {
 public:
  /// Refuses keys that are not among `keys`, which must outlive the table.
  TomlTable(const TomlFile& file, const toml::table& table, TomlKeys keys);
  TomlTable(const TomlFile& file, TomlKeys keys) : TomlTable(file, file.root, keys) {}

  /// The same table, whose refusals, and those of the tables in it, end with this subject.
  TomlTable about(std::string subject) const {
    TomlTable table = *this;
    table.subject_ = std::move(subject);
    return table;
  }

  bool has(std::string_view key) const { return node(key) != nullptr; }
  /// Of a key that is there.
  int line(std::string_view key) const;

  // Each reads the value of a key into `target` and is true, or leaves it alone and is false where
  // the key is absent. Refuses a wrong type. Numbers may be written as integers.
  bool read(std::string_view key, bool& target) const;
  bool read(std::string_view key, int& target) const;
  bool read(std::string_view key, std::int64_t& target) const;
  bool read(std::string_view key, double& target) const;
  bool read(std::string_view key, std::string& target) const;
  bool read(std::string_view key, Vec3& target) const;
  bool read(std::string_view key, Quat& target) const;  ///< [w, x, y, z]
  bool read(std::string_view key, std::span<double> target) const;
  bool read(std::string_view key, std::span<std::int64_t> target) const;
  bool read(std::string_view key, std::vector<std::array<double, 3>>& target) const;
  bool read(std::string_view key, std::vector<std::array<std::int64_t, 3>>& target) const;

  /// Lists of numbers, of any lengths.
  bool read(std::string_view key, std::vector<std::vector<double>>& target) const;

  template <class T>
  bool read(std::string_view key, std::optional<T>& target) const {
    T value{};
    if (!read(key, value)) return false;
    target = value;
    return true;
  }

  template <class E>
  bool read(std::string_view key, E& target, std::type_identity_t<TomlNames<E>> names) const {
    std::string text;
    if (!read(key, text)) return false;
    std::string known;
    for (const auto& [name, value] : names) {
      if (text == name) {
        target = value;
        return true;
      }
      known += (known.empty() ? "" : ", ") + std::string(name);
    }
    refuse(key, "\"" + text + "\" is none of " + known);
  }

  /// The table written [key], if there is one.
  std::optional<TomlTable> table(std::string_view key, TomlKeys keys) const;
  /// The tables written [[key]], in the order of the file.
  std::vector<TomlTable> tables(std::string_view key, TomlKeys keys) const;

  /// "FILE:LINE: key: reason", with the line of the key, or of the table where it is absent.
  [[noreturn]] void refuse(std::string_view key, const std::string& reason) const;
  /// "FILE:LINE: reason", with the line of the table.
  [[noreturn]] void refuse(const std::string& reason) const;

 private:
  const toml::node* node(std::string_view key) const;
  const toml::array* array(std::string_view key, std::size_t size, const std::string& wanted) const;
  template <class Number, class Take>
  bool read_triples(std::string_view key, const std::string& wanted, Take&& take,
                    std::vector<std::array<Number, 3>>& target) const;
  [[noreturn]] void refuse_type(std::string_view key, const toml::node& found,
                                const std::string& wanted) const;
  [[noreturn]] void refuse_at(const toml::source_region& where, const std::string& reason) const;

  const TomlFile* file_;
  const toml::table* table_;
  TomlKeys keys_;
  std::string subject_;
};

}  // namespace cradle
