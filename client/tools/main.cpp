/// `cradle`: a world from the command line.
#include <cradle/client.h>
#include <cradle/version.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>

#include "session.h"
#include "status.h"
#include "watch.h"
#include "world_commands.h"

using namespace cradle;
using namespace cradle::tool;

namespace {

struct Arguments {
  ClientOptions options = ClientOptions::from_environment("cradle");
  double timeout_s = 3;
  Action action;
};

/// Seconds from 0 on; CLI::Range lets "nan" pass.
std::string check_seconds(const std::string& text) {
  const double seconds = std::strtod(text.c_str(), nullptr);
  return seconds >= 0 && seconds <= 1e6 ? "" : text + " is not a time of 0 to 1e6 s";
}

void add_options(CLI::App& app, Arguments& arguments) {
  app.add_option("--lcm-url", arguments.options.lcm_url,
                 "udpm://GROUP:PORT?ttl=N, or a recording, file://PATH; else from CRADLE_LCM_URL")
      ->type_name("URL");
  app.add_option("--world", arguments.options.world, "name; else from CRADLE_WORLD, or default")
      ->type_name("NAME");
  app.add_option("--timeout", arguments.timeout_s, "for the connection, and for each answer (s)")
      ->check(check_seconds)
      ->type_name("S");
  const std::string version =
      "cradle " CRADLE_VERSION ", protocol " + std::to_string(kProtocolVersion);
  app.set_version_flag("--version", version);
  app.require_subcommand(1);
  app.fallthrough();  // the options above are welcome after the subcommand too
  app.footer(
      "A body is an id or a name.\n"
      "Exit codes: 0 done; 1 refused; 2 wrong usage; 69 no network, no such world or recording, or "
      "no answer.");
}

void add_status(CLI::App& app, Arguments& arguments) {
  const auto is_json = std::make_shared<bool>(false);
  CLI::App* sub = app.add_subcommand("status", "What the world says about itself");
  sub->add_flag("--json", *is_json, "for programs");
  sub->callback([&arguments, is_json] {
    arguments.options.is_spectator = true;  // it is shown by a full world, too
    arguments.action = [is_json](Session& session) -> int {
      const WorldStatus& status = session.client.status();
      // A recording may begin between two heartbeats.
      while (status.rate_hz == 0 && session.client.is_recording() && !session.client.has_ended()) {
        session.client.poll(std::chrono::milliseconds(10));
      }
      std::fputs((*is_json ? to_json(status) : describe(status)).c_str(), stdout);
      return kExitOk;
    };
  });
}

void add_watch(CLI::App& app, Action& action) {
  const auto seconds = std::make_shared<double>(std::numeric_limits<double>::infinity());
  CLI::App* sub = app.add_subcommand("watch", "A live table of the bodies that move");
  sub->add_option("--seconds", *seconds, "how long; else until Ctrl-C")
      ->check(check_seconds)
      ->type_name("S");
  sub->callback([&action, seconds] {
    action = [seconds](Session& session) {
      return watch(session, std::chrono::duration<double>(*seconds));
    };
  });
}

void add_replay(CLI::App& app, Arguments& arguments) {
  struct Files {
    std::string control, states;
    double speed = 1;
  };
  const auto files = std::make_shared<Files>();
  CLI::App* sub = app.add_subcommand("replay", "Watch what lcm-logger recorded");
  sub->add_option("file", files->control, "of the world's port, or of its state port")->required();
  sub->add_option("states", files->states, "of the state port, if the other is not");
  CLI::Option* speed = sub->add_option("--speed", files->speed, "times real time (default 1)");
  speed->check(check_seconds)->type_name("X");
  sub->add_flag_callback(
         "--fast", [files] { files->speed = 0; }, "as fast as it goes")
      ->excludes(speed);
  sub->callback([&arguments, files] {
    arguments.options.lcm_url = recording_url(files->control, files->states, files->speed);
    arguments.action = [](Session& session) {
      return watch(session, std::chrono::duration<double>(std::numeric_limits<double>::infinity()));
    };
  });
}

int run(const Arguments& arguments) {
  const std::chrono::milliseconds timeout(std::llround(1e3 * arguments.timeout_s));
  const Connection connection = Client::connect(arguments.options, timeout);
  if (connection.client) {
    Session session{*connection.client, timeout};
    return arguments.action(session);
  }
  complain(connection.message);
  const bool is_misuse =
      connection.result == Result::bad_url || connection.result == Result::bad_name;
  return is_misuse ? kExitUsage : kExitUnavailable;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Looks at a world of a Cradle server, and changes it.", "cradle");
  Arguments arguments;
  add_options(app, arguments);
  add_status(app, arguments);
  add_watch(app, arguments.action);
  add_replay(app, arguments);
  add_world_commands(app, arguments.action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    complain(std::string(error.what()) + "; see cradle --help");
    return kExitUsage;
  }
  return run(arguments);
}
