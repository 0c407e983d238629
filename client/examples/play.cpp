/// Plays in a world for some seconds: drops bodies, and kicks them about. Nothing in here waits for
/// an answer: commands go out, and what became of them comes back through poll().
///
/// Usage: example_play [SECONDS]; the world is that of CRADLE_LCM_URL and CRADLE_WORLD.
#include <cradle/client.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

using namespace cradle;
using namespace std::chrono_literals;

namespace {

/// The k-th body: balls and boxes by turns, falling on a ring around the middle.
BodySpec falling_body(int k) {
  const double angle_rad = 2.4 * k;  // about the golden angle: no two at one place
  BodySpec spec;
  const bool is_ball = k % 2 == 0;
  spec.name = (is_ball ? "ball-" : "box-") + std::to_string(k);
  spec.shape = is_ball ? Shape::sphere(0.3) : Shape::box({0.3, 0.2, 0.25});
  spec.density_kgpm3 = 500;
  spec.material.restitution = is_ball ? 0.6 : 0.1;
  spec.p_WBo = {1.8 * std::cos(angle_rad), 1.8 * std::sin(angle_rad), 3};
  spec.w_WB = {1, 2, 0};
  return spec;
}

/// A kick towards the middle and up, 4 m/s at the surface rather than at the centre: it spins, too.
Wrench kick(const BodyState& state) {
  const Vec3& p = state.p_WBo;
  const double distance_m = std::hypot(p.x, p.y) + 0.1;
  Wrench wrench;
  wrench.body = state.body;
  wrench.quantity = WrenchQuantity::impulse;
  wrench.value = {-160 * p.x / distance_m, -160 * p.y / distance_m, 120};  // N s, for some 50 kg
  wrench.point_kind = WrenchPoint::world_point;
  wrench.point = {p.x, p.y, p.z - 0.1};
  return wrench;
}

}  // namespace

int main(int argc, char** argv) {
  const Connection world = Client::connect(ClientOptions::from_environment("play"), 3s);
  if (!world.client) {
    std::fprintf(stderr, "play: %s\n", world.message.c_str());
    return 69;
  }
  Client& client = *world.client;

  std::vector<BodyId> mine;
  int refused = 0;
  client.on_answer([&](Ticket, const Answer& answer) {
    if (!answer) ++refused;
    if (answer && answer.body) mine.push_back(answer.body);
  });

  const double end_s = client.time_s() + (argc > 1 ? std::atof(argv[1]) : 10);
  double next_s = client.time_s();
  for (int k = 0; client.is_alive() && client.time_s() < end_s; client.poll(10ms)) {
    if (client.time_s() < next_s) continue;
    next_s += 0.5;
    const BodyView* last = mine.empty() ? nullptr : client.find(mine.back());
    if (k % 2 == 0 || last == nullptr) {
      client.spawn(falling_body(k / 2));
    } else {
      client.push(kick(last->state));
    }
    ++k;
  }

  const ClientStatistics s = client.statistics();
  std::printf("%lld commands, %d refused, %lld sent again, round trip %.1f ms\n",
              static_cast<long long>(s.answers), refused, static_cast<long long>(s.resends),
              1e3 * s.round_trip_smoothed_s);
  return refused == 0 ? 0 : 1;
}
