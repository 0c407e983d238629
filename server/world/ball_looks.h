/// What balls meet that go where they were not expected, as one part of space sees it.
#pragma once

#include "server/dynamics/impact/ball_events.h"
#include "server/world/state.h"

namespace cradle {

/// Those of different parts may look around side by side, if all obstacles have their numbers.
class BallLooks final : public BallSurroundings {
 public:
  BallLooks(World::State& s, BallPart& part) : s_(s), balls_(s.balls), part_(part) {}

  /// Among others only if the ball leaves the box that its pairs were sought with.
  void look_around(StruckBall& ball, double now) override;
  void before_impacts(StruckBall& ball) override;
  void expect(std::int32_t number) const override;
  BallMaterial material_of(const BallPair& pair) override;

 private:
  Aabb way_of(const StruckBall& ball, double from) const;
  void list_partners(std::int32_t number);
  bool is_partner(std::int32_t slot) const;
  void meet(std::int32_t number, std::int32_t slot);
  template <class F>
  void for_each_collider_in(const Aabb& way, const F& visit) const;

  World::State& s_;
  Ballistic& balls_;
  BallPart& part_;
};

/// Of the collider in this slot.
Aabb& box_of_collider(World::State& s, std::int32_t slot);
/// The number of what stands in the way of balls; it gets one if it has none.
std::int32_t obstacle_of(World::State& s, std::int32_t slot);
bool is_obstacle(const World::State& s, std::int32_t slot);

}  // namespace cradle
