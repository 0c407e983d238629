#include "server/trace.h"
#include "tests/bench/side_by_side.h"
#include "tests/bench/table.h"

namespace cradle::bench {
namespace {

constexpr std::size_t kWidth = 11;  // of a column, characters

/// A word for a cell; CSV has the whole outcome.
std::string word(const std::string& outcome) { return outcome.substr(0, outcome.find(':')); }

std::vector<std::string> names_of(std::span<const PeerLibrary> libraries) {
  std::vector<std::string> names{"scene", "us a tick", "error"};
  for (const PeerLibrary& library : libraries) {
    const std::string name(library.name);
    names.insert(names.end(), {name + " us", "error", "ours/" + name});
  }
  names.emplace_back("error_kind");
  return names;
}

std::string as_line(const std::vector<std::string>& cells) {
  std::vector<Column> columns(cells.size(), {"", kWidth});
  columns.front().width = 5;
  return cells_line(columns, cells, Format::table);
}

std::string side_by_side_line(const SideBySide& result) {
  std::vector<std::string> cells{std::string(result.which->name)};
  const auto text = [&](const auto& value) { return text_of(value, Format::table); };
  for (const Fared& engine : result.engines) {
    cells.push_back(engine.is_ok() ? text(time_us(*result.which, engine.row)) : "-");
    cells.push_back(engine.is_ok() ? text(engine.row.error) : word(engine.outcome));
    if (&engine != &result.engines.front()) cells.push_back(text(engine.ratio));
  }
  cells.emplace_back(result.which->error_kind);
  return as_line(cells);
}

std::string with_columns(std::string csv_line, const std::string& more) {
  csv_line.pop_back();  // the end of the line
  return csv_line + "," + more + "\n";
}

}  // namespace

std::string peers_header(Format format, std::span<const PeerLibrary> libraries) {
  if (format == Format::csv) return with_columns(header(format), "outcome,ours_by_theirs");
  return as_line(names_of(libraries));
}

std::string peers_lines(Format format, const SideBySide& result) {
  if (format == Format::table) return side_by_side_line(result);
  std::string lines;
  for (const Fared& engine : result.engines) {
    lines += with_columns(line(format, engine.row),
                          csv_field(engine.outcome) + "," + text_of(engine.ratio, format));
  }
  return lines;
}

}  // namespace cradle::bench
