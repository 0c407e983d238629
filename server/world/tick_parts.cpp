#include "server/world/tick_parts.h"

#include <algorithm>

#include "server/collision/index.h"
#include "server/world/state.h"

namespace cradle {
namespace {

bool can_be_parted(const World::State& s) { return s.settings.collides_twice && !s.keeps_accounts; }

}  // namespace

int parts_of_tick(const World::State& s) { return can_be_parted(s) && s.closes_fast ? 2 : 1; }

bool strikes_fast(const World::State& s) {
  if (!can_be_parted(s)) return false;
  const double fast_mps = s.margin_at_rest / s.dt;
  return std::ranges::any_of(s.pairs, [&](const BodyPair& pair) {
    const std::size_t a = index(pair.a), b = index(pair.b);
    const bool is_new = (s.bodies.is_moving(a) && s.bodies.in_contact[a] == 0) ||
                        (s.bodies.is_moving(b) && s.bodies.in_contact[b] == 0);
    return is_new && (s.bodies.v[b] - s.bodies.v[a]).squaredNorm() > fast_mps * fast_mps;
  });
}

void note_closing(World::State& s) {
  s.closes_fast = s.dt * s.overlaps.closing_mps > s.margin_at_rest;
}

}  // namespace cradle
