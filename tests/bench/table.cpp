#include "tests/bench/table.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "server/trace.h"

namespace cradle::bench {

constexpr int kDigits = 4;  // of a number in the table

std::string text_of(double value, Format format) {
  if (std::isnan(value)) return "nan";  // whatever its sign
  std::array<char, 32> text;            // the shortest form of a double has at most 24
  const auto end = format == Format::csv ? std::to_chars(text.begin(), text.end(), value)
                                         : std::to_chars(text.begin(), text.end(), value,
                                                         std::chars_format::general, kDigits);
  return {text.begin(), end.ptr};
}

std::string text_of(const std::optional<double>& value, Format format) {
  return value ? text_of(*value, format) : std::string();
}

std::string cells_line(std::span<const Column> columns, const std::vector<std::string>& cells,
                       Format format) {
  std::string text;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (format == Format::csv) {
      text += (i > 0 ? "," : "") + csv_field(cells[i]);
      continue;
    }
    text += cells[i];
    const std::size_t rest = columns[i].width - std::min(columns[i].width, cells[i].size());
    if (i + 1 < cells.size()) text.append(rest + 2, ' ');
  }
  return text + '\n';
}

std::string names_line(std::span<const Column> columns, Format format) {
  std::vector<std::string> names;
  for (const Column& column : columns) names.emplace_back(column.name);
  return cells_line(columns, names, format);
}

}  // namespace cradle::bench
