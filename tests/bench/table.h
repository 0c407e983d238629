/// Lines of a table for people, or of CSV for programs.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/bench/report.h"

namespace cradle::bench {

struct Column {
  std::string_view name;
  std::size_t width;  ///< in the table
};

/// The names of the columns, as a line.
std::string names_line(std::span<const Column> columns, Format format);
/// A line of as many cells.
std::string cells_line(std::span<const Column> columns, const std::vector<std::string>& cells,
                       Format format);

/// As report.h tells; nothing for none.
std::string text_of(double value, Format format);
std::string text_of(const std::optional<double>& value, Format format);

}  // namespace cradle::bench
