/// The impacts of a tick among balls that only fall, each at its time: ball_events.cpp.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "server/dynamics/impact/balls.h"
#include "server/dynamics/impact/reflections.h"

namespace cradle {

/// Knows what a ball may meet that goes where it was not expected.
class BallSurroundings {
 public:
  virtual ~BallSurroundings() = default;
  /// After an impact at `now`: may add pairs to BallEvents::pairs, their times not yet known.
  virtual void look_around(std::int32_t ball, double now) = 0;
  /// Of one that has had no impact yet.
  virtual void before_impacts(std::int32_t ball, StruckBall& struck) = 0;
  /// Will be asked that of it soon, most likely.
  virtual void expect(std::int32_t ball) const = 0;
  virtual BallMaterial material_of(const BallPair& pair) = 0;
};

struct BallReport {
  int impacts = 0;  ///< of balls in contact, a set that is struck at once is one
  int ordered = 0;  ///< sets of more contacts than are solved at once: one after the other
  int spent =
      0;  ///< balls with so many impacts that they stayed where they were for the rest of it
};

/// Reuses its memory from tick to tick.
class BallEvents {
 public:
  std::vector<Ball> balls;
  std::vector<StruckBall> struck;      ///< by ball, of those that have had impacts
  std::vector<std::int32_t> deviated;  ///< which these are, by their first ones
  std::vector<Obstacle> obstacles;
  std::vector<BallPair> pairs;  ///< sorted as events at the same time are to be

  /// Of a tick of `dt` seconds: no obstacles and pairs are there yet, and balls of no use.
  void begin(double dt, const Vector& gravity);
  double first_time(const BallPair& pair) const;
  /// `is_out`, by ball: those take no part. Pairs have their times.
  BallReport run(std::span<const std::uint8_t> is_out, BallSurroundings& surroundings);
  template <class F>
  void for_each_pair_of(std::int32_t ball, F&& f) const {
    for (std::int32_t at = first_[static_cast<std::size_t>(ball)]; at >= 0;) {
      f(at / 2);
      at = next_[static_cast<std::size_t>(at)];
    }
  }
  Vector position(std::int32_t ball, double t) const;
  Vector velocity(std::int32_t ball, double t) const;

 private:
  struct Due {
    double time;
    std::int32_t pair;
    int impacts_a, impacts_b;  // of the balls when it was foreseen
  };
  /// A touching pair at the time of an impact.
  struct Contact {
    std::int32_t pair;
    Vector n;  // from a to b
    double impulse;
    BallMaterial material;
  };

  double time_of(const BallPair& pair, double now) const;
  double time_along(const BallPair& pair, double now) const;
  void expect(std::int32_t pair, const BallSurroundings& surroundings) const;
  bool take_next(Due& now);
  static bool is_later(const Due& one, const Due& other);
  const Ball* partner(const BallPair& pair) const;
  void link_new_pairs();
  void foresee(std::int32_t pair, double now);
  void foresee_all_of(std::int32_t ball, double now);
  void strike(std::int32_t pair, double t, BallSurroundings& surroundings);
  void stay(Ball& ball, const Vector& x);
  bool rests(std::int32_t ball) const;
  void gather(std::int32_t pair, double t, BallSurroundings& surroundings);
  bool is_touching(const BallPair& pair, double t, Vector& n) const;
  void reflect_together();
  void reflect_in_order();
  double coupling(const Contact& one, const Contact& other) const;
  double inverse_mass(const BallPair& pair) const;
  double restitution(const Contact& contact) const;
  double normal_velocity(const Contact& contact) const;
  void push(const Contact& contact, const Vector& impulse);
  void push_normal(Contact& contact, double impulse);
  void rub(const Contact& contact, double t);
  void rub_turning(const Contact& contact, double t);
  static void spin(StruckBall& ball, const Vector& change, double t);
  void rest_if_due(const Contact& contact, double t);
  double dt_ = 0;
  Vector g_ = Vector::Zero();
  std::span<const std::uint8_t> is_out_;
  BallReport report_;
  std::vector<Due> due_;       // of the tick's beginning, in their order
  std::size_t next_due_ = 0;   // of these
  std::vector<Due> foreseen_;  // since, a heap
  std::vector<std::int32_t>
      first_;  // by ball: the newest of its pairs, times 2, plus the side; or -1
  std::vector<std::int32_t> next_;  // two a pair: the pair before, likewise
  std::vector<Contact> struck_;
  std::vector<std::int32_t> changed_;  // balls of the set that is struck
  std::vector<Vector> v_, x_;          // by place in changed_: at the time of the impact
  std::vector<std::int32_t> place_;    // by ball: in changed_, or -1
};

inline bool BallEvents::rests(std::int32_t number) const {
  const auto i = static_cast<std::size_t>(number);
  return balls[i].impacts > 0 && !struck[i].held.isZero(0);
}

inline Vector BallEvents::position(std::int32_t number, double t) const {
  const Ball& ball = balls[static_cast<std::size_t>(number)];
  Vector x = ball.x + t * ball.v + 0.5 * t * t * g_;
  const double left = dt_ - t;
  if (rests(number)) x -= 0.5 * left * left * struck[static_cast<std::size_t>(number)].held;
  return x;
}

inline Vector BallEvents::velocity(std::int32_t number, double t) const {
  Vector v = balls[static_cast<std::size_t>(number)].v + t * g_;
  if (rests(number)) v += (dt_ - t) * struck[static_cast<std::size_t>(number)].held;
  return v;
}

}  // namespace cradle
