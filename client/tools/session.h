/// What every subcommand of `cradle` works with: a client, the time it may take, how it ends.
#pragma once

#include <cradle/client.h>

#include <chrono>
#include <functional>
#include <string>
#include <vector>

namespace cradle::tool {

enum ExitCode : int {
  kExitOk = 0,
  kExitRefused = 1,      ///< the server, or the client library, said no
  kExitUsage = 2,        ///< the command line is wrong
  kExitUnavailable = 69  ///< no network, no such world, or no answer
};

struct Session {
  Client& client;
  std::chrono::milliseconds timeout;
};

/// A subcommand after its arguments are parsed; gives the exit code.
using Action = std::function<int(Session&)>;

/// One line on stderr.
void complain(const std::string& line);

/// Waits for the answer; prints what was refused, or on success `tick N`.
int finish(Session& session, Ticket ticket);

/// Turns ids and names into ids, waiting for names to be told. Empty, after a line on stderr, if a
/// name is not known.
std::vector<BodyId> find_bodies(Session& session, const std::vector<std::string>& texts);

}  // namespace cradle::tool
