// When the solver "hybrid" tries Newton's method: again after attempts in vain, and of a large
// island if soft steps have nearly balanced it.
#include "server/dynamics/contact/newton/hand_over.h"

#include <catch2/catch.hpp>
#include <vector>

#include "server/collision/index.h"
#include "server/dynamics/contact/contact_solver.h"

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

/// Many cubes of 1 kg on a thin plate that lies on the ground, all still, as soft steps left them.
class LoadedPlate {
 public:
  LoadedPlate() {
    add(0, 0);        // the ground
    add(1000, 1000);  // the plate
    for (int k = 0; k < kCubes; ++k) add(1, 1.0 / 6);
    for (std::size_t slot = 1; slot < v_.size(); ++slot) {
      moving_.push_back(static_cast<std::int32_t>(slot));
    }
  }
  /// A tick; contacts carry the balance of all loads, less this share of it.
  ContactReport step(double unbalanced) {
    BodyArrays arrays;
    arrays.x = x_, arrays.q = q_, arrays.v = v_, arrays.w = w_;
    arrays.inverse_mass = inverse_mass_;
    arrays.inertia = inertia_, arrays.inverse_inertia = inverse_inertia_;
    arrays.acceleration = acceleration_, arrays.torque = torque_;
    arrays.poise = poise_;
    std::vector<ContactConstraint> contacts;
    for (std::int32_t b = 1; b < static_cast<std::int32_t>(x_.size()); ++b) {
      const double half_m = b == 1 ? 20 : 0.5;
      const double kg = b == 1 ? 1000 + kCubes : 1;
      contacts.push_back(
          make_constraint(square(index(b), half_m), b == 1 ? 0 : 1, b, arrays, inverse_inertia_W_));
      ContactConstraint& c = contacts.back();
      c.friction = 0.5;
      c.is_known = true;
      find_effective_masses(c);
      for (ConstraintPoint& p : c.used()) {
        p.force = (1 - unbalanced) * kg * kGravity_mps2 / 4;
        p.press = p.force * c.K_normal(p);
      }
      look_at(c);
    }
    std::vector<ContactConstraint*> constraints;
    for (ContactConstraint& c : contacts) constraints.push_back(&c);
    ContactTick tick;
    tick.dt = 1.0 / 60;
    tick.tolerance_m = 5e-4;
    tick.moving = moving_;
    return make_contact_solver("hybrid")->advance(tick, arrays, inverse_inertia_W_, constraints);
  }

 private:
  static constexpr int kCubes = 520;
  static constexpr double kGravity_mps2 = 9.81;

  void add(double kg, double inertia) {
    const auto k = static_cast<int>(x_.size()) - 2;
    x_.push_back(k < 0 ? Vector(Vector::Zero())
                       : Vector(1.5 * (k % 26) - 18.75, 1.5 * (k / 26) - 14.25, 0.5));
    q_.push_back(Rotation::Identity());
    for (auto* const none : {&v_, &w_, &torque_}) none->push_back(Vector::Zero());
    acceleration_.push_back(kg > 0 ? Vector(0, 0, -kGravity_mps2) : Vector(Vector::Zero()));
    inverse_mass_.push_back(kg > 0 ? 1 / kg : 0);
    inertia_.push_back(Vector::Constant(inertia));
    inverse_inertia_.push_back(Vector::Constant(inertia > 0 ? 1 / inertia : 0));
    inverse_inertia_W_.push_back(Matrix(inverse_inertia_.back().asDiagonal()));
    poise_.push_back({Poise::soft, 0, 0, 0, 4});
  }
  /// Below a body.
  Manifold square(std::size_t slot, double half_m) const {
    Manifold manifold;
    manifold.count = 4;
    for (std::uint32_t i = 0; i < 4; ++i) {
      const Vector corner(i < 2 ? -half_m : half_m, i % 2 == 0 ? -half_m : half_m, 0);
      manifold.points[i] = {Vector(x_[slot].x(), x_[slot].y(), 0) + corner, 0, i + 1};
    }
    return manifold;
  }

  std::vector<Vector> x_, v_, w_, inertia_, inverse_inertia_, acceleration_, torque_;
  std::vector<Rotation> q_;
  std::vector<Matrix> inverse_inertia_W_;
  std::vector<double> inverse_mass_;
  std::vector<Poise> poise_;
  std::vector<std::int32_t> moving_;
};

}  // namespace

TEST_CASE("a large island is not tried while more than a fiftieth of its loads is unbalanced") {
  // Forces that are all smaller by a share leave that share of all loads. Heaps that Newton's
  // method could take over were out of balance by up to 9e-3, the others by 5e-2 or more:
  // hand_over.cpp. These forces it would find at once, if it was let.
  const auto is_taken_over = [](double unbalanced) {
    const ContactReport report = LoadedPlate().step(unbalanced);
    REQUIRE(report.islands_taken_over + report.islands_makeshift == 1);
    return report.islands_taken_over == 1;
  };
  for (const double share : {0.0, 1e-5, 9e-3, 0.019}) {
    CAPTURE(share);
    CHECK(is_taken_over(share));
  }
  for (const double share : {0.021, 5e-2, 0.13}) {
    CAPTURE(share);
    CHECK_FALSE(is_taken_over(share));
  }
}

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
