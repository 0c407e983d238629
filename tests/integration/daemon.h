/// What tests of the daemon share: connecting, waiting, making bodies.
#pragma once

#include <cradle/client.h>

#include <chrono>
#include <functional>
#include <memory>

#include "tests/integration/process.h"

namespace cradle {

/// A client of the world "test" on own_url(), or null.
std::unique_ptr<Client> connect(std::chrono::milliseconds timeout = std::chrono::seconds(20));

/// Polls until `is_done`; false if that does not come. Returns at once when it does: not a timing.
bool poll_until(Client& client, const std::function<bool()>& is_done,
                std::chrono::milliseconds timeout = std::chrono::seconds(20));

/// A sphere of 0.5 m and 1 kg.
BodySpec ball_spec(const Vec3& p_WBo);

/// Makes one and waits for it; no body if that fails.
BodyId spawn_ball(Client& client, const Vec3& p_WBo);

}  // namespace cradle
