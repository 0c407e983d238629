// A game that has nothing of Cradle but what is installed.
#include <cradle/client.h>

#include <cstdio>

int main() {
  using namespace std::chrono_literals;
  const auto world = cradle::Client::connect(cradle::ClientOptions::from_environment("game"), 20s);
  if (!world.client) return std::puts(world.message.c_str()), 69;
  cradle::BodySpec ball;
  ball.shape = cradle::Shape::sphere(0.25);
  ball.p_WBo = {1, -2, 4.5};
  const cradle::Answer made = world.client->wait(world.client->spawn(ball), 20s);
  while (made && !world.client->find(made.body)) world.client->poll(10ms);
  const cradle::Vec3 p = made ? world.client->find(made.body)->state.p_WBo : cradle::Vec3{};
  std::printf("%s at %g %g %g\n", to_string(made.result).data(), p.x, p.y, p.z);
  return made ? 0 : 1;
}
