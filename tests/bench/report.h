/// Rows as CSV for programs, or as a table for people.
#pragma once

#include <string>

#include "tests/bench/run.h"

namespace cradle::bench {

enum class Format { csv, table };

/// The names of the columns, as a line.
std::string header(Format format);

/// A row, as a line. Numbers of a CSV can be read back to the same bits, those of a table have four
/// digits; what is not a number is "nan", what has no meaning is empty.
std::string line(Format format, const Row& row);

}  // namespace cradle::bench
