// cradle_bench: speed and error of every scene, one row a run.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <utility>

#include "server/collision/machine_lanes.h"
#include "server/dynamics/free_flight.h"
#include "server/exit_code.h"
#include "server/large_pages.h"
#include "server/thread_pool.h"
#include "server/trace.h"
#include "server/world/world.h"
#include "tests/bench/broad.h"
#include "tests/bench/engine_report.h"
#include "tests/bench/growth.h"
#include "tests/bench/ladders.h"
#include "tests/bench/pair.h"
#include "tests/bench/plot.h"
#include "tests/bench/precision_report.h"
#include "tests/bench/report.h"
#include "tests/bench/side_by_side.h"

namespace {

using namespace cradle;
using namespace cradle::bench;

constexpr const char* kAll = "all";
constexpr const char* kBroad = "broad";
constexpr const char* kPair = "pair";
constexpr const char* kLadders = "ladders";
constexpr const char* kGrowth = "growth";
constexpr const char* kSchemes = "schemes";
constexpr const char* kEngines = "engines";

void list() {
  for (const Case& one : cases()) {
    std::cout << std::left << std::setw(5) << one.name << std::setw(47) << one.about
              << std::setw(42) << one.error_kind << one.scene_file << '\n';
  }
  for (const BroadCase& one : broad_cases()) {
    std::cout << std::left << std::setw(15) << one.name << one.about << '\n';
  }
  for (const PairCase& one : pair_cases()) std::cout << one.name << '\n';
  for (const GrowthCase& one : growth_cases()) {
    std::cout << std::left << std::setw(15) << one.name << one.about << '\n';
  }
  std::cout << kLadders << "        stacks of 5 to 40 cubes, 10 to 10 000 kg on one and on ten\n";
}

std::vector<std::string> scene_names() {
  std::vector<std::string> names{kAll};
  for (const Case& one : cases()) names.emplace_back(one.name);
  names.emplace_back(kBroad);
  for (const BroadCase& one : broad_cases()) names.emplace_back(one.name);
  names.emplace_back(kPair);
  for (const PairCase& one : pair_cases()) names.emplace_back(one.name);
  names.emplace_back(kGrowth);
  for (const GrowthCase& one : growth_cases()) names.emplace_back(one.name);
  names.emplace_back(kLadders);
  return names;
}

/// --peers, and there are none.
class NoPeersError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};
constexpr int kExitNoPeers = 69;  // EX_UNAVAILABLE of sysexits.h

/// Those that this program was built with; says which are missing.
std::vector<PeerLibrary> peers_here() {
  std::vector<PeerLibrary> found;
  std::string missing;
  for (const PeerLibrary& library : peer_libraries()) {
    if (library.make != nullptr) {
      found.push_back(library);
    } else {
      missing += (missing.empty() ? "" : " and ") + std::string(library.package);
    }
  }
  const std::string advice = "install " + missing + ", and run cmake again";
  if (found.empty()) throw NoPeersError("built without other libraries: " + advice);
  if (!missing.empty()) std::cerr << "cradle_bench: one library is missing: " << advice << '\n';
  return found;
}

/// Runs what is named, row by row: a table of its own for each kind of case.
class Tables {
 public:
  explicit Tables(const std::string& csv_file)
      : format_(csv_file.empty() ? Format::table : Format::csv),
        output_(csv_file.empty() ? "-" : csv_file) {}

  /// `all` stands for all of `cases`; `lines` gives the rows of one of them.
  template <class Cases, class Lines>
  void add(const std::vector<std::string>& names, const std::string& all, const Cases& cases,
           const std::string& header, Lines lines) {
    std::string head = (has_rows_ ? "\n" : "") + header;
    for (const std::string& name : names) {
      for (const auto& one : cases) {
        if (name != all && name != one.name) continue;
        output_.write(std::exchange(head, "") + lines(one));
        has_rows_ = true;
      }
    }
  }
  /// A table whose rows are made one after the other.
  template <class Rows, class Line>
  void add_rows(const std::string& header, const Rows& rows, Line line) {
    output_.write((has_rows_ ? "\n" : "") + header);
    for (const auto& row : rows) output_.write(line(row));
    has_rows_ = true;
  }
  Format format() const { return format_; }
  void finish() { output_.finish(); }

 private:
  Format format_;
  Output output_;
  bool has_rows_ = false;
};

std::string lines_beside_peers(Format format, const Case& which, const Options& options,
                               std::span<const PeerLibrary> libraries, int rounds) {
  const SideBySide result = compare(which, scene_of(which), options, libraries, rounds);
  for (const Fared& engine : result.engines) {
    if (engine.is_ok()) continue;
    std::cerr << which.name << ", " << engine.row.engine << ": " << engine.outcome << '\n';
  }
  return peers_lines(format, result);
}

/// Beside peers if there are rounds.
void run_all(const std::vector<std::string>& names, const Options& options, int rounds,
             const std::string& csv_file) {
  const bool with_peers = rounds > 0;
  std::vector<PeerLibrary> libraries;
  if (with_peers) libraries = peers_here();
  Tables tables(csv_file);
  const Format format = tables.format();
  if (with_peers) {
    tables.add(names, kAll, cases(), peers_header(format, libraries), [&](const Case& one) {
      return is_for_peers(one) ? lines_beside_peers(format, one, options, libraries, rounds) : "";
    });
  } else {
    tables.add(names, kAll, cases(), header(format),
               [&](const Case& one) { return line(format, run(one, options)); });
  }
  tables.add(names, kBroad, broad_cases(), broad_header(format),
             [&](const BroadCase& one) { return line(format, run(one)); });
  tables.add(names, kPair, pair_cases(), pair_header(format), [&](const PairCase& one) {
    std::string lines;
    for (const PairRow& row : run(one)) lines += line(format, row);
    return lines;
  });
  tables.add(names, kGrowth, growth_cases(), growth_header(format), [&](const GrowthCase& one) {
    std::string lines;
    std::vector<GrowthRow> rows;
    for (const int number : one.numbers) {
      rows.push_back(run(one, number));
      lines += growth_line(format, one, rows);
    }
    return lines;
  });
  if (std::ranges::count(names, kLadders) > 0) {
    tables.add_rows(ladders_header(format, libraries), ladder_rungs(), [&](const Rung& rung) {
      return ladders_line(format, rung, compare(*rung.which, rung.scene, options, libraries, 1));
    });
  }
  tables.finish();
}

/// Without gnuplot both parts leave their data before the first complains.
void write_reports(const std::string& folder, const std::string& part) {
  std::vector<PeerLibrary> libraries;
  for (const PeerLibrary& library : peer_libraries()) {
    if (library.make != nullptr) libraries.push_back(library);
  }
  std::exception_ptr complaint;
  try {
    if (part.empty() || part == kSchemes) write_precision_report(folder);
  } catch (const PlotError&) {
    complaint = std::current_exception();
  }
  if (part.empty() || part == kEngines) write_engine_report(folder, libraries);
  if (part.empty() || part == kGrowth) write_growth_report(folder);
  if (complaint) std::rethrow_exception(complaint);
}

int fail(const std::exception& error, int code) {
  std::cerr << "cradle_bench: " << error.what() << '\n';
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  keep_memory_in_large_pages();  // as cradled
  CLI::App app("Speed and error of the benchmark scenes, one row a scene.", "cradle_bench");
  std::vector<std::string> names;
  Options options;
  std::string csv_file;
  bool only_list = false, with_peers = false;
  int rounds = kSideBySideRounds;
  std::string report_folder, report_part;
  app.add_flag("--list", only_list, "Names, subjects, kinds of error and files of the scenes");
  app.add_option(
         "scene", names,
         "Scenes by name, or all; rows broad:*, pair:* and growth:* by name, or broad, pair and "
         "growth; ladders")
      ->check(CLI::IsMember(scene_names()));
  app.add_option("--method", options.method, "Contact solver; default: what the scene says")
      ->check(CLI::IsMember(solver_names()));
  app.add_option("--dt", options.dt_s, "Seconds a tick")
      ->check(CLI::Range(1 / limits::kRateMax_hz, 1 / limits::kRateMin_hz));
  app.add_option("--substeps", options.sub_steps, "Sub-steps a tick")
      ->check(CLI::Range(1, limits::kSubStepsMax));
  app.add_option("--threads", options.threads, "Threads that share the work of a step")
      ->check(CLI::Range(1, ThreadPool::kThreadsMax));
  app.add_option("--lanes", options.lanes, "Bodies that fly side by side; default: as many as go")
      ->check(CLI::IsMember(machine_lanes()));
  app.add_flag("--peers", with_peers,
               "Run the scenes by Bullet and ODE, too: times and errors of all, in turns");
  app.add_option("--rounds", rounds, "Of --peers: how often each engine runs, in turns")
      ->check(CLI::Range(1, 1000));
  app.add_option("--csv", csv_file, "Write CSV to this file, - is standard output");
  CLI::App* report = app.add_subcommand("report",
                                        "Work against precision, of the schemes of free flight, "
                                        "and of engines in contact, and growth "
                                        "with the number of bodies: data, diagrams, tables");
  report->add_option("DIR", report_folder, "Folder to write to; made if need be")->required();
  report->add_option("--only", report_part, "One part of it: schemes, engines, or growth")
      ->check(CLI::IsMember({kSchemes, kEngines, kGrowth}));
  try {
    app.parse(argc, argv);
    if (report->parsed()) {
      write_reports(report_folder, report_part);
    } else if (only_list) {
      list();
    } else if (names.empty()) {
      throw CLI::RequiredError("scene");
    } else {
      run_all(names, options, with_peers ? rounds : 0, csv_file);
    }
    return kExitOk;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  } catch (const SceneError& error) {
    return fail(error, kExitData);
  } catch (const NoPeersError& error) {
    return fail(error, kExitNoPeers);
  } catch (const std::filesystem::filesystem_error& error) {
    return fail(error, kExitNoInput);
  } catch (const PlotError& error) {
    return fail(error, kExitOutput);
  } catch (const OutputError& error) {
    return fail(error, kExitOutput);
  } catch (const std::exception& error) {
    return fail(error, kExitInternal);
  }
}
