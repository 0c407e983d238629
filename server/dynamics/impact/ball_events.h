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
  virtual void look_around(StruckBall& ball, double now) = 0;
  /// Of one that has had no impact yet: `number`, `ball` and what needs no telling are set.
  virtual void before_impacts(StruckBall& ball) = 0;
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
  std::vector<BallPair> pairs;  ///< sorted as events at the same time are to be

  /// Of a tick: nobody has been struck, and there are no pairs yet. The scene may get more
  /// obstacles, and is to stay where it is.
  void begin(const BallScene& scene);
  /// `is_out`, by ball: those take no part. Pairs have their times.
  void run(std::span<const std::uint8_t> is_out, BallSurroundings& surroundings);

  /// Those that have had impacts, by their first ones.
  std::span<const StruckBall> struck() const { return struck_; }
  /// Null: it has not.
  const StruckBall* struck(std::int32_t ball) const {
    const std::int32_t at = at_[static_cast<std::size_t>(ball)];
    return at < 0 ? nullptr : &struck_[static_cast<std::size_t>(at)];
  }
  const Ball& ball(std::int32_t number) const {
    const StruckBall* const one = struck(number);
    return one != nullptr ? one->ball : scene_->balls[static_cast<std::size_t>(number)];
  }
  /// Of impacts whose first ball `is_mine(number)`.
  template <class F>
  BallReport report(const F& is_mine) const;
  /// Some ball has come to rest on an obstacle: what it may meet is told by nothing but the grid.
  bool any_rests() const { return any_rests_; }
  /// Whether two touch now, or will before the tick ends; true if one rests.
  bool do_meet(std::int32_t a, std::int32_t b, double now) const;

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
  struct Strike {
    std::int32_t ball;  // the first one
    bool is_ordered;
    int spent;
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
  void link_new_pairs();
  void foresee(std::int32_t pair, double now);
  void foresee_all_of(std::int32_t ball, double now);
  void strike(std::int32_t pair, double t, BallSurroundings& surroundings);
  void stay(Ball& ball, const Vector& x);
  int impacts_of(std::int32_t ball) const;
  StruckBall& struck_of(std::int32_t ball);
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

  const BallScene* scene_ = nullptr;
  double dt_ = 0;
  Vector g_ = Vector::Zero();
  std::span<const std::uint8_t> is_out_;
  std::vector<StruckBall> struck_;
  std::vector<std::int32_t> at_;  // by ball: where in `struck_`; -1: it was not
  std::vector<Strike> strikes_;
  bool any_rests_ = false;
  std::vector<Due> due_;       // of the tick's beginning, in their order
  std::size_t next_due_ = 0;   // of these
  std::vector<Due> foreseen_;  // since, a heap
  std::vector<std::int32_t>
      first_;  // by ball: the newest of its pairs, times 2, plus the side; or -1
  std::vector<std::int32_t> next_;  // two a pair: the pair before, likewise
  std::vector<Contact> contacts_;
  std::vector<std::int32_t> changed_;  // balls of the set that is struck
  std::vector<Vector> v_, x_;          // by place in changed_: at the time of the impact
  std::vector<std::int32_t> place_;    // by ball: in changed_, or -1
};

template <class F>
BallReport BallEvents::report(const F& is_mine) const {
  BallReport report;
  for (const Strike& strike : strikes_) {
    if (!is_mine(strike.ball)) continue;
    ++report.impacts;
    report.ordered += strike.is_ordered ? 1 : 0;
    report.spent += strike.spent;
  }
  return report;
}

inline bool BallEvents::rests(std::int32_t number) const {
  const StruckBall* const one = struck(number);
  return one != nullptr && !one->held.isZero(0);
}

/// Of no ball: 0.
inline int BallEvents::impacts_of(std::int32_t number) const {
  const StruckBall* const one = number < 0 ? nullptr : struck(number);
  return one != nullptr ? one->ball.impacts : 0;
}

inline StruckBall& BallEvents::struck_of(std::int32_t number) {
  return struck_[static_cast<std::size_t>(at_[static_cast<std::size_t>(number)])];
}

inline Vector BallEvents::position(std::int32_t number, double t) const {
  const Ball& one = ball(number);
  Vector x = one.x + t * one.v + 0.5 * t * t * g_;
  const double left = dt_ - t;
  if (rests(number)) x -= 0.5 * left * left * struck(number)->held;
  return x;
}

inline Vector BallEvents::velocity(std::int32_t number, double t) const {
  Vector v = ball(number).v + t * g_;
  if (rests(number)) v += (dt_ - t) * struck(number)->held;
  return v;
}

}  // namespace cradle
