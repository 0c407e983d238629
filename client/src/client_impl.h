/// What is behind a Client: make one of any ClientCore by
/// `Client(std::make_unique<Client::Impl>(…))`.
#pragma once

#include <cradle/client.h>

#include "client/src/client_core.h"

namespace cradle {

struct Client::Impl {
  /// As ClientCore.
  Impl(const std::string& world, std::string name, std::unique_ptr<Transport> control,
       ClientCore::OpenStates open_states, const ClientCore::Identity& identity = {})
      : core(world, std::move(name), std::move(control), std::move(open_states), identity) {}

  /// As Client::poll.
  int poll(std::chrono::milliseconds wait);

  ClientCore core;
};

/// Waits until the world welcomes us, at most `timeout`; `place` says in messages where we look.
/// Fails with no_world, no_network, bad_version, timed_out, or what the server answers to hello.
Connection introduce(std::unique_ptr<Client::Impl> impl, const std::string& world,
                     const std::string& place, std::chrono::milliseconds timeout);

}  // namespace cradle
