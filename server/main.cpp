// cradled: the command line of the server. What can go wrong is thrown; here is the only catch.
//
// Exit codes (also at the end of --help):
//    0  done
//   64  the command line is wrong
//   65  the scene is wrong
//   66  a scene or configuration file cannot be read
//   69  no network: no multicast, or the port cannot be opened
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
#include "server/simulate.h"
#include "server/trace.h"

namespace cradle {
namespace {

constexpr const char* kExitCodes =
    "Exit codes: 0 done; 64 command line wrong; 65 scene wrong; 66 no such input file;\n"
    "69 no network; 70 internal fault; 73 cannot write output; 75 world taken; 78 configuration "
    "wrong.";

/// Flags of `serve`; those that are given override the configuration file.
struct ServeFlags {
  std::string config;
  std::optional<std::string> scene, world, lcm_url;
  std::optional<double> rate_hz;
  bool lockstep = false;
  bool print_limits = false;
};

void add_serve(CLI::App& app, ServeFlags& flags) {
  CLI::App* serve = app.add_subcommand("serve", "Run a world on the network until SIGTERM");
  serve->add_option("--config", flags.config, "Configuration (TOML); flags override it");
  serve->add_option("--scene", flags.scene, "Scene to begin with (TOML)");
  serve->add_option("--world", flags.world, "Name of the world");
  serve->add_option("--lcm-url", flags.lcm_url, "Like udpm://239.255.76.67:7667?ttl=0");
  serve->add_option("--rate", flags.rate_hz, "Ticks a second, instead of the scene's");
  serve->add_flag("--lockstep", flags.lockstep, "Step only on a client's step command");
  serve->add_flag("--print-limits", flags.print_limits, "Print all limits and end");
  serve->footer(kExitCodes);
}

void add_simulate(CLI::App& app, SimulateOptions& options) {
  CLI::App* simulate = app.add_subcommand("simulate", "Run a scene without network, at full speed");
  simulate->add_option("SCENE", options.scene, "Scene (TOML)")->required();
  simulate->add_option("--duration", options.duration_s, "Simulated time, s")->required();
  simulate->add_option("--dt", options.dt_s, "Length of a tick, s, instead of the scene's");
  simulate->add_option("--substeps", options.sub_steps, "Sub-steps a tick, instead of the scene's");
  simulate->add_option("--trace", options.trace, "All bodies after each tick (CSV); -: stdout");
  simulate->add_option("--summary", options.summary,
                       "What the run came to (JSON); -: stdout, also if there is no --trace");
  simulate->add_option("--threads", options.threads, "Threads to step with")->capture_default_str();
  simulate->footer(kExitCodes);
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
  PRINT(kRateMin_hz);
  PRINT(kRateMax_hz);
  PRINT(kSubStepsMax);
#undef PRINT
}

int serve(const ServeFlags& flags) {
  if (flags.print_limits) {
    print_limits();
    return kExitOk;
  }
  Config config;
  if (!flags.config.empty()) config = load_config(flags.config);
  if (flags.scene) config.scene = *flags.scene;
  if (flags.world) config.world = *flags.world;
  if (flags.lcm_url) config.lcm_url = *flags.lcm_url;
  if (flags.rate_hz) config.rate_hz = *flags.rate_hz;
  if (flags.lockstep) config.lockstep = true;
  if (const auto fault = find_fault(config)) {
    throw OptionError(std::string(fault->key) + ": " + fault->reason);
  }
  return run_daemon(config);
}

int fail(int code, std::string line) {
  std::replace(line.begin(), line.end(), '\n', ' ');
  std::cerr << "cradled: " << line << '\n';
  return code;
}

int run(int argc, char** argv) {
  CLI::App app("A rigid body physics server", "cradled");
  app.set_version_flag("--version",
                       "cradled " CRADLE_VERSION ", protocol " + std::to_string(kProtocolVersion));
  app.require_subcommand(1);
  app.footer(kExitCodes);
  ServeFlags serve_flags;
  SimulateOptions simulate_options;
  add_serve(app, serve_flags);
  add_simulate(app, simulate_options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& request) {
    return app.exit(request);  // prints the help or the version
  }
  if (app.got_subcommand("serve")) return serve(serve_flags);
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
  try {
    return run(argc, argv);
  } catch (const CLI::ParseError& error) {
    return fail(kExitUsage, error.what() + std::string("; see cradled --help"));
  } catch (const OptionError& error) {
    return fail(kExitUsage, error.what() + std::string("; see cradled --help"));
  } catch (const SceneError& error) {
    return fail(kExitData, error.what());
  } catch (const ConfigError& error) {
    return fail(kExitConfig, error.what());
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
