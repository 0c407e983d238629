// cradled: the command line of the server. What can go wrong is thrown; here is the only catch.
//
// Exit codes (also at the end of --help):
//    0  done
//   64  the command line is wrong
//   65  the scene is wrong
//   66  a scene or configuration file cannot be read
//   69  no network: no multicast, or a port cannot be opened
//   70  a fault of the program
//   73  an output file cannot be written
//   75  another daemon serves this world
//   78  the configuration is wrong
// Errors are one line on standard error.
#include <cradle/limits.h>
#include <cradle/version.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>

#include "server/daemon.h"
#include "server/exit_code.h"
#include "server/explain.h"
#include "server/large_pages.h"
#include "server/log_line.h"
#include "server/serve.h"
#include "server/simulate.h"
#include "server/trace.h"

namespace cradle {
namespace {

constexpr const char* kExitCodes =
    "Exit codes: 0 done; 64 command line wrong; 65 scene wrong; 66 no such input file;\n"
    "69 no network; 70 internal fault; 73 cannot write output; 75 world taken; 78 configuration "
    "wrong.";

/// Flags of `serve` and `print-config`.
struct ServeFlags {
  std::optional<std::string> config;
  std::vector<std::pair<std::string, const CLI::Option*>> settings;
  bool print_limits = false;

  ConfigSources sources() const {
    ConfigSources all{config, process_environment(), {}};
    for (const auto& [flag, option] : settings) {
      if (option->count() > 0) all.flags.emplace_back(flag, option->as<std::string>());
    }
    return all;
  }
};

/// --config, and a flag for every setting; a yes or no is --flag, or --flag=false.
void add_settings(CLI::App& command, ServeFlags& flags) {
  command.add_option("--config", flags.config,
                     std::string("configuration (TOML) instead of ") + kDefaultConfigFile);
  for (const Setting& setting : all_settings()) {
    const bool is_bool = std::holds_alternative<bool Config::*>(setting.field);
    const std::string name = setting.flag(), meaning(setting.meaning);
    const CLI::Option* option = is_bool ? command.add_flag(name, meaning)
                                        : command.add_option(name, meaning)->type_name("VALUE");
    flags.settings.emplace_back(name, option);
  }
  command.footer(
      std::string("A flag wins over its variable of the environment, like CRADLE_LCM_URL, "
                  "and that over the file.\n") +
      kExitCodes);
}

void add_serve(CLI::App& app, ServeFlags& flags) {
  CLI::App* serve = app.add_subcommand("serve", "Run a world on the network until SIGTERM");
  add_settings(*serve, flags);
  serve->add_flag("--print-limits", flags.print_limits, "print all limits and end");
}

void add_print_config(CLI::App& app, ServeFlags& flags) {
  add_settings(*app.add_subcommand("print-config",
                                   "Print what serve with these flags would run with, and why"),
               flags);
}

void add_check(CLI::App& app, std::string& file) {
  CLI::App* check = app.add_subcommand("check", "Find what is wrong in a configuration file");
  check->add_option("FILE", file, "Configuration (TOML)")->required();
  check->footer(kExitCodes);
}

void add_simulate(CLI::App& app, SimulateOptions& options) {
  CLI::App* simulate = app.add_subcommand("simulate", "Run a scene without network, at full speed");
  simulate->add_option("SCENE", options.scene, "Scene (TOML)")->required();
  simulate->add_option("--duration", options.duration_s, "Simulated time, s")->required();
  simulate->add_option("--dt", options.dt_s, "Length of a tick, s, instead of the scene's");
  simulate->add_option("--substeps", options.sub_steps, "Sub-steps a tick, instead of the scene's");
  simulate->add_option("--solver", options.solver, "Contact solver, instead of the scene's")
      ->check(CLI::IsMember(solver_names()));
  simulate->add_option("--scheme", options.scheme, "Scheme of free flight, instead of the scene's")
      ->check(CLI::IsMember(scheme_names()));
  simulate->add_flag("--full", options.is_full,
                     "Every free body through every term, to compare with what explain says");
  simulate->add_option("--trace", options.trace, "All bodies after each tick (CSV); -: stdout");
  simulate->add_option("--summary", options.summary,
                       "What the run came to (JSON); -: stdout, also if there is no --trace");
  simulate->add_option("--threads", options.threads, "Threads to step with")->capture_default_str();
  simulate->footer(kExitCodes);
}

void add_explain(CLI::App& app, ExplainOptions& options) {
  CLI::App* explain = app.add_subcommand(
      "explain", "Tell what a scene's bodies do without, and how wrong that may be");
  explain->add_option("SCENE", options.scene, "Scene (TOML)")->required();
  explain->add_option("--duration", options.duration_s, "Simulated time, s")->capture_default_str();
  explain->add_option("--dt", options.dt_s, "Length of a tick, s, instead of the scene's");
  explain->add_option("--scheme", options.scheme, "Scheme of free flight, instead of the scene's")
      ->check(CLI::IsMember(scheme_names()));
  explain->footer(kExitCodes);
}

void print_limits() {
  using namespace limits;
  const auto print = [](const char* name, auto value) {
    std::cout << name << ' ' << value << '\n';
  };
#define PRINT(name) print(#name, name)
  PRINT(kNameBytes);
  PRINT(kWorldNameBytes);
  PRINT(kNetworkDatagramBytes);
  PRINT(kLoopbackDatagramBytes);
  PRINT(kTrailerBytes);
  PRINT(kIntegerMax);
  PRINT(kPositionMax_m);
  PRINT(kSpeedMax_mps);
  PRINT(kAngularSpeedMax_radps);
  PRINT(kSizeMin_m);
  PRINT(kSizeMax_m);
  PRINT(kMassMin_kg);
  PRINT(kMassMax_kg);
  PRINT(kInertiaMin_kgm2);
  PRINT(kInertiaMax_kgm2);
  PRINT(kFrictionMax);
  PRINT(kTurningFrictionMax_m);
  PRINT(kWrenchMax);
  PRINT(kGravityMax_mps2);
  PRINT(kReceiptsKept);
  PRINT(kHeldCommands);
  PRINT(kQueuedCommands);
  PRINT(kTicksAhead);
  PRINT(kClients);
  PRINT(kInboxDatagrams);
  PRINT(kInboxBytes);
  PRINT(kWaitingBytes);
  PRINT(kStepsPerCommand);
  PRINT(kBodies);
  PRINT(kWrenches);
  PRINT(kGeometries);
  PRINT(kPoints);
  PRINT(kTriangles);
  PRINT(kParts);
  PRINT(kCorners);
  PRINT(kRateMin_hz);
  PRINT(kRateMax_hz);
  PRINT(kSubStepsMax);
  PRINT(kContactToleranceMin_m);
  PRINT(kContactToleranceMax_m);
#undef PRINT
}

int finish_output() {
  if (!std::cout.flush()) throw OutputError("standard output cannot be written");
  return kExitOk;
}

int serve(const ServeFlags& flags) {
  if (flags.print_limits) {
    print_limits();
    return finish_output();
  }
  return run_daemon(flags.sources());
}

/// Faults go to standard error, one a line.
int check(const std::string& file) {
  const std::vector<std::string> faults = find_faults(file);
  for (const std::string& fault : faults) std::cerr << printable(fault) << '\n';
  if (!faults.empty()) return kExitConfig;
  std::cout << file << ": ok\n";
  return finish_output();
}

int fail(int code, std::string line) {
  std::replace(line.begin(), line.end(), '\n', ' ');
  std::cerr << "cradled: " << printable(line) << '\n';
  return code;
}

int run(int argc, char** argv) {
  CLI::App app("A rigid body physics server", "cradled");
  app.set_version_flag("--version",
                       "cradled " CRADLE_VERSION ", protocol " + std::to_string(kProtocolVersion));
  app.require_subcommand(1);
  app.footer(kExitCodes);
  ServeFlags serve_flags, print_flags;
  std::string checked;
  SimulateOptions simulate_options;
  add_serve(app, serve_flags);
  add_print_config(app, print_flags);
  add_check(app, checked);
  add_simulate(app, simulate_options);
  ExplainOptions explain_options;
  add_explain(app, explain_options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& request) {
    return app.exit(request);  // prints the help or the version
  }
  if (app.got_subcommand("serve")) return serve(serve_flags);
  if (app.got_subcommand("print-config")) {
    print_config(std::cout, load_config(print_flags.sources()));
    return finish_output();
  }
  if (app.got_subcommand("check")) return check(checked);
  if (app.got_subcommand("explain")) {
    explain(explain_options);
    return kExitOk;
  }
  if (simulate_options.trace.empty() && simulate_options.summary.empty()) {
    simulate_options.summary = "-";
  }
  simulate(simulate_options);
  return kExitOk;
}

}  // namespace
}  // namespace cradle

int main(int argc, char** argv) {
  using namespace cradle;
  keep_memory_in_large_pages();
  try {
    return run(argc, argv);
  } catch (const CLI::ParseError& error) {
    return fail(kExitUsage, error.what() + std::string("; see cradled --help"));
  } catch (const OptionError& error) {
    return fail(kExitUsage, error.what() + std::string("; see cradled --help"));
  } catch (const SceneError& error) {
    return fail(kExitData, error.what());
  } catch (const ConfigError& error) {
    return fail(error.exit_code, error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    return fail(kExitNoInput, error.path1().string() + ": " + error.code().message());
  } catch (const OutputError& error) {
    return fail(kExitOutput, error.what());
  } catch (const StartupError& error) {
    return fail(error.exit_code, error.what());
  } catch (const std::exception& error) {
    return fail(kExitInternal, error.what());
  }
}
