#include <cstdio>

#include "tests/integration/daemon.h"

namespace cradle {

std::unique_ptr<Client> connect(std::chrono::milliseconds timeout) {
  ClientOptions options;
  options.lcm_url = own_url();
  options.world = "test";
  options.name = "test client";
  Connection connection = Client::connect(options, timeout);
  if (!connection.client) std::fprintf(stderr, "%s\n", connection.message.c_str());
  return std::move(connection.client);
}

bool poll_until(Client& client, const std::function<bool()>& is_done,
                std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (!is_done()) {
    if (std::chrono::steady_clock::now() >= deadline) return false;
    client.poll(std::chrono::milliseconds(10));
  }
  return true;
}

BodySpec ball_spec(const Vec3& p_WBo) {
  BodySpec spec;
  spec.shape = Shape::sphere(0.5);
  spec.mass_kg = 1;
  spec.p_WBo = p_WBo;
  return spec;
}

BodyId spawn_ball(Client& client, const Vec3& p_WBo) {
  return client.wait(client.spawn(ball_spec(p_WBo)), std::chrono::seconds(20)).body;
}

}  // namespace cradle
