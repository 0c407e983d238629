// Implicit Euler solves its equations, at any speed and stiffness, or says that it does not.
#include <catch2/catch.hpp>
#include <limits>
#include <span>

#include "tests/physics/flock.h"
#include "tests/physics/schemes.h"

namespace cradle {

TEST_CASE("implicit Euler solves fast tumbling, and never gains energy") {
  std::mt19937_64 random(7);
  const Scheme& scheme = *find_scheme("implicit_euler");
  Work work;
  double residual = 0, gain = 0;
  for (int i = 0; i < 2000; ++i) {
    const Inertia inertia{1, random_inertia(random)};
    const Vector& J = inertia.moments;
    const double turn = 0.1 * std::pow(1000, uniform(random, 0, 1));  // h |w|, 0.1 .. 100
    const double h = 1.0 / 60;
    Flight body{Vector::Zero(), Rotation::Identity(), Vector::Zero(),
                turn / h * random_axis(random)};
    for (int step = 0; step < 3; ++step) {
      const Vector w0 = body.q.conjugate() * body.w;
      const double E0 = rotational_energy(body, inertia);
      scheme.advance(body, inertia, {}, h, work);
      const Vector w1 = body.q.conjugate() * body.w;
      const Vector left = J.cwiseProduct(w1 - w0) + h * w1.cross(J.cwiseProduct(w1));
      residual = std::fmax(residual, left.norm() / J.cwiseProduct(w0).norm());
      gain = std::fmax(gain, rotational_energy(body, inertia) / E0 - 1);
    }
  }
  CHECK(work.unsolved == 0);
  CHECK(residual < 1e-9);
  CHECK(gain < 1e-12);
}

TEST_CASE("implicit Euler solves stiff springs and drag") {
  std::mt19937_64 random(8);
  const Scheme& scheme = *find_scheme("implicit_euler");
  Work work;
  for (int i = 0; i < 500; ++i) {
    const Inertia inertia{1, random_inertia(random)};
    FlightLoads loads;
    loads.force_W = {0, 0, -9.81};
    loads.drag = {uniform(random, 0, 100), uniform(random, 0, 10), uniform(random, 0, 100)};
    Anchor anchor;
    anchor.point_B = random_vector(random, 1);
    anchor.point_W = random_vector(random, 3);
    anchor.stiffness = std::pow(10, uniform(random, 0, 6));
    anchor.damping = std::pow(10, uniform(random, -1, 3));
    anchor.rest_length = uniform(random, 0, 1);
    loads.anchors = std::span(&anchor, 1);
    Flight body{random_vector(random, 1), Rotation::Identity(), random_vector(random, 10),
                random_vector(random, 20)};
    for (int step = 0; step < 10; ++step) {
      scheme.advance(body, inertia, loads, 1.0 / 60, work);
      REQUIRE(body.x.allFinite());
    }
  }
  CHECK(work.unsolved == 0);
}

TEST_CASE("a step that implicit schemes cannot solve is counted") {
  FlightLoads loads;
  loads.force_W = {std::numeric_limits<double>::quiet_NaN(), 0, 0};
  loads.drag.linear = 1;
  for (const char* name : {"implicit_euler", "stoermer_verlet"}) {
    Flight body{Vector::Zero(), Rotation::Identity(), Vector(1, 0, 0), Vector(1, 2, 3)};
    Work work;
    find_scheme(name)->advance(body, kBox, loads, 0.1, work);
    CAPTURE(name);
    CHECK(work.unsolved == 1);
  }
}

}  // namespace cradle
