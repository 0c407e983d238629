/// The smallest client: makes a ball, pushes it, watches it fly, takes it away again.
#include <cradle/client.h>

#include <cstdio>

using namespace cradle;
using namespace std::chrono_literals;

int main() {
  const Connection world = Client::connect(ClientOptions::from_environment("hello"), 3s);
  if (!world.client) {
    std::fprintf(stderr, "hello: %s\n", world.message.c_str());
    return 69;
  }
  Client& client = *world.client;

  BodySpec ball;
  ball.shape = Shape::sphere(0.25);  // m
  ball.mass_kg = 2;
  ball.p_WBo = {0, 0, 5};
  const Answer made = client.wait(client.spawn(ball), 1s);
  if (!made) return 1;

  Wrench kick;  // of 6 N s at the centre of mass: 3 m/s
  kick.body = made.body;
  kick.quantity = WrenchQuantity::impulse;
  kick.value = {6, 0, 0};
  client.push(kick);

  client.on_tick([&](Tick tick) {
    const BodyView* seen = client.find(made.body);
    if (!seen || tick % 10 != 0) return;
    const Vec3& p = seen->state.p_WBo;
    std::printf("%6.2f s   x %5.2f m   z %5.2f m\n", client.time_s(), p.x, p.z);
  });
  while (client.is_alive() && client.tick() < made.tick + 60) client.poll(100ms);

  return client.wait(client.despawn(made.body), 1s) ? 0 : 1;
}
