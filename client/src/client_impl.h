/// What is behind a Client: make one of any ClientCore by
/// `Client(std::make_unique<Client::Impl>(…))`.
#pragma once

#include <cradle/client.h>

#include "client/src/client_core.h"
#include "protocol/transport/recording.h"

namespace cradle {

struct Client::Impl {
  /// As ClientCore.
  Impl(const std::string& world, std::string name, std::unique_ptr<Transport> control,
       ClientCore::OpenStates open_states, const ClientCore::Identity& identity = {})
      : core(world, std::move(name), std::move(control), std::move(open_states), identity) {}

  /// A client of a recording of `world`.
  Impl(const std::string& world, std::unique_ptr<Recording> file)
      : recording(file.get()), core(world, "", std::move(file), nullptr) {}

  /// As Client's commands and Client::poll.
  Ticket submit(CommandBody body, Tick target_tick);
  int poll(std::chrono::milliseconds wait);
  int poll_once();

  Recording* recording = nullptr;  ///< the control transport of `core`, or null
  ClientCore core;
};

/// A client of a recording that has seen the first message of it. Fails as Client::connect.
Connection connect_to_recording(const ClientOptions& options);

/// Waits until the world welcomes us, at most `timeout`; `place` says in messages where we look.
/// Fails with no_world, no_network, bad_version, timed_out, or what the server answers to hello.
Connection introduce(std::unique_ptr<Client::Impl> impl, const std::string& world,
                     const std::string& place, std::chrono::milliseconds timeout);

}  // namespace cradle
