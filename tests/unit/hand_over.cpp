// When the solver "hybrid" tries Newton's method again after attempts in vain.
#include "server/dynamics/contact/newton/hand_over.h"

#include <catch2/catch.hpp>
#include <vector>

namespace cradle {
namespace {

using Attempt = HandOver::Attempt;

/// A body by itself, whose attempts are told to succeed or not.
class Trials {
 public:
  /// How many ticks it is left to soft steps before the next attempt, which is in vain.
  int wait_then_fail(Attempt attempt = Attempt::in_vain) {
    int waited = 0;
    while (begin() == HandOver::Choice::soft) {
      end(Attempt::none);
      ++waited;
    }
    end(attempt);
    return waited;
  }
  /// Ticks in which nobody ends its sway, from now on.
  int free_ticks() const { return poise_[0].free; }
  void move_fast() {
    v_[0] = Vector(1, 0, 0);
    CHECK(begin() == HandOver::Choice::soft);
    end(Attempt::none);
    v_[0].setZero();
  }

 private:
  HandOver::Choice begin() {
    ContactTick tick;
    tick.tolerance_m = 5e-4;
    tick.moving = moving_;
    islands_.find(tick, v_.size(), {});
    BodyArrays arrays;
    arrays.v = v_;
    arrays.w = w_;
    arrays.inverse_mass = inverse_mass_;
    arrays.inertia = inertia_;
    arrays.poise = poise_;
    hand_over_.begin(tick, arrays, islands_, {});
    return hand_over_.choice(0);
  }
  void end(Attempt attempt) {
    hand_over_.note(0, attempt);
    hand_over_.end(serial_executor);
  }

  HandOver hand_over_;
  TickIslands islands_;
  std::vector<std::int32_t> moving_{0};
  std::vector<Vector> v_{Vector::Zero()}, w_{Vector::Zero()}, inertia_{Vector::Ones()};
  std::vector<double> inverse_mass_{1};
  std::vector<Poise> poise_{{Poise::newton, 0, 0, 0, 4}};
};

}  // namespace

TEST_CASE("attempts in vain make a group wait twice as long each time, until it has moved fast") {
  Trials trials;
  for (const int ticks : {0, 10, 20, 40, 80, 160, 320, 320}) {
    CHECK(trials.wait_then_fail() == ticks);
  }
  trials.move_fast();
  CHECK(trials.wait_then_fail() == 319);  // what it waits for already stays
  CHECK(trials.wait_then_fail() == 10);
}

TEST_CASE("what begins to move as it is taken over may sway as long as it waits") {
  Trials trials;
  CHECK(trials.wait_then_fail(Attempt::moves) == 0);
  CHECK(trials.free_ticks() == 10);
  CHECK(trials.wait_then_fail(Attempt::moves) == 10);
  CHECK(trials.free_ticks() == 20);
  CHECK(trials.wait_then_fail(Attempt::in_vain) == 20);
  CHECK(trials.free_ticks() == 0);
}

}  // namespace cradle
