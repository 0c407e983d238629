// cradle_bench: speed and error of every scene, one row a run.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <utility>

#include "server/dynamics/free_flight.h"
#include "server/exit_code.h"
#include "server/thread_pool.h"
#include "server/trace.h"
#include "server/world/world.h"
#include "tests/bench/broad.h"
#include "tests/bench/precision_report.h"
#include "tests/bench/report.h"

namespace {

using namespace cradle;
using namespace cradle::bench;

constexpr const char* kAll = "all";
constexpr const char* kBroad = "broad";

void list() {
  for (const Case& one : cases()) {
    std::cout << std::left << std::setw(5) << one.name << std::setw(47) << one.about
              << std::setw(42) << one.error_kind << one.scene_file << '\n';
  }
  for (const BroadCase& one : broad_cases()) {
    std::cout << std::left << std::setw(15) << one.name << one.about << '\n';
  }
}

std::vector<std::string> scene_names() {
  std::vector<std::string> names{kAll};
  for (const Case& one : cases()) names.emplace_back(one.name);
  names.emplace_back(kBroad);
  for (const BroadCase& one : broad_cases()) names.emplace_back(one.name);
  return names;
}

void run_all(const std::vector<std::string>& names, const Options& options,
             const std::string& csv_file) {
  const Format format = csv_file.empty() ? Format::table : Format::csv;
  Output output(csv_file.empty() ? "-" : csv_file);
  std::string head = header(format);
  for (const std::string& name : names) {
    for (const Case& one : cases()) {
      if (name != kAll && name != one.name) continue;
      output.write(std::exchange(head, "") + line(format, run(one, options)));
    }
  }
  const bool is_second = head.empty();
  head = (is_second ? "\n" : "") + broad_header(format);
  for (const std::string& name : names) {
    for (const BroadCase& one : broad_cases()) {
      if (name != kBroad && name != one.name) continue;
      output.write(std::exchange(head, "") + line(format, run(one)));
    }
  }
  output.finish();
}

int fail(const std::exception& error, int code) {
  std::cerr << "cradle_bench: " << error.what() << '\n';
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Speed and error of the benchmark scenes, one row a scene.", "cradle_bench");
  std::vector<std::string> names;
  Options options;
  std::string csv_file;
  bool only_list = false;
  std::string report_folder;
  app.add_flag("--list", only_list, "Names, subjects, kinds of error and files of the scenes");
  app.add_option("scene", names, "Scenes by name, or all; rows broad:* by name, or broad")
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
      ->check(CLI::IsMember(flight_lanes()));
  app.add_option("--csv", csv_file, "Write CSV to this file, - is standard output");
  CLI::App* report = app.add_subcommand(
      "report", "Work against precision of the schemes of free flight: data, diagrams, table");
  report->add_option("DIR", report_folder, "Folder to write to; made if need be")->required();
  try {
    app.parse(argc, argv);
    if (report->parsed()) {
      write_precision_report(report_folder);
    } else if (only_list) {
      list();
    } else if (names.empty()) {
      throw CLI::RequiredError("scene");
    } else {
      run_all(names, options, csv_file);
    }
    return kExitOk;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  } catch (const SceneError& error) {
    return fail(error, kExitData);
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
