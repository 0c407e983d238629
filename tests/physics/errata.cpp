// The errata of the seed paper (Rueth, "Rigid Body Physics", II.A to II.C) that concern motion: a
// test each, which fails with the printed form. Those of mass and contact: errata_contact.cpp.
#include <catch2/catch.hpp>

#include "tests/physics/schemes.h"
#include "tests/physics/worlds.h"

namespace cradle {

TEST_CASE("E1: the arm of a force points from the centre to the point of load, in every scheme") {
  // Printed: T = (x - xi) x F. A spring at (1, 0, 0) in B pulls along +z: w_y becomes negative.
  const Anchor anchor{{1, 0, 0}, {1, 0, 1000}, 1e-3, 0, 0};
  FlightLoads loads;
  loads.anchors = std::span(&anchor, 1);
  for (const Scheme& scheme : schemes()) {
    CAPTURE(scheme.name);
    const Flight end = run(scheme, {}, {1, {1, 1, 1}}, loads, 1e-3, 1);
    CHECK(end.w.y() == Approx(-1e-3).epsilon(1e-5));
  }
}

TEST_CASE("E2: the gyroscopic term is in every scheme") {
  // Printed: T = J alpha. Then w would stay; W' = -J^-1 (W x J W) at the start.
  Flight start;
  start.w = {1, 2, 3};
  const Vector& J = kBox.moments;
  const Vector expected = -start.w.cross(J.cwiseProduct(start.w)).cwiseQuotient(J);
  for (const Scheme& scheme : schemes()) {
    CAPTURE(scheme.name);
    const double h = 1e-5;
    const Flight end = run(scheme, start, kBox, {}, h, 1);
    CHECK(((end.q.conjugate() * end.w - start.w) / h - expected).norm() < 1e-3);
  }
}

TEST_CASE("E3: a torque meets the inertia as the body is turned now, in every scheme") {
  // Printed: alpha = J^-1 T with constant J. Random attitudes: alpha = R J^-1 R^T T.
  FlightLoads loads;
  loads.torque_W = {0.3, -0.7, 0.5};
  for (int k = 1; k <= 10; ++k) {
    Flight start;
    start.q = normalised(Rotation(1, 0.3 * k, -0.7 + 0.1 * k, 0.2 * k));
    const Matrix R = start.q.toRotationMatrix();
    const Vector alpha = rotated_diagonal(R, kBox.moments.cwiseInverse()) * loads.torque_W;
    for (const Scheme& scheme : schemes()) {
      CAPTURE(scheme.name, k);
      const double h = 1e-6;
      CHECK((run(scheme, start, kBox, loads, h, 1).w / h - alpha).norm() < 1e-6 * alpha.norm());
    }
  }
}

TEST_CASE("E4: no vector's derivative is the angular velocity") {
  // Printed: phi' = w. With w = (cos t, sin t, 0), a sphere driven step by step; against q' = w q /
  // 2 by RK4 with short steps. The rotation by the integral of w is elsewhere.
  const double time_s = 3;
  const int count = 3000;
  const double h = time_s / count;
  const auto w = [](double t) { return Vector(std::cos(t), std::sin(t), 0); };
  const auto rate = [&](const Eigen::Vector4d& at, double t) {
    return Eigen::Vector4d(0.5 * (Rotation(0, w(t).x(), w(t).y(), 0) * Rotation(at)).coeffs());
  };
  Rotation q = Rotation::Identity();
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector4d y = q.coeffs();
    const Eigen::Vector4d k1 = rate(y, i * h), k2 = rate(y + h / 2 * k1, (i + 0.5) * h);
    const Eigen::Vector4d k3 = rate(y + h / 2 * k2, (i + 0.5) * h);
    const Eigen::Vector4d k4 = rate(y + h * k3, (i + 1) * h);
    const Eigen::Vector4d end = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    q = normalised(Rotation(end));
  }
  for (const Scheme& scheme : schemes()) {
    CAPTURE(scheme.name);
    Flight body;
    Work work;
    for (int i = 0; i < count; ++i) {
      body.w = w((i + 0.5) * h);
      scheme.advance(body, {1, {1, 1, 1}}, {}, h, work);
    }
    CHECK(angle(body.q, q) < 1e-5);
  }
  const Vector phi(std::sin(time_s), 1 - std::cos(time_s), 0);
  CHECK(angle(rotation_exp(phi), q) > 0.5);
}

TEST_CASE("E6: positions are integrals of velocity from the step's start to its end") {
  // Printed: v where x must stand, and integrals over the whole step for every t.
  FlightLoads loads;
  loads.force_W = {0, 0, -kGravity};
  Flight start;
  start.x = {7, 8, 9};
  start.v = {3, 4, 5};
  for (const Scheme& scheme : schemes()) {
    for (const int count : {1, 2, 50}) {
      CAPTURE(scheme.name, count);
      const Flight end = run(scheme, start, {}, loads, 0.5, count);
      const Vector x = start.x + 0.5 * start.v + 0.125 * loads.force_W;
      const double allowed = scheme.order == 1 ? kGravity * 0.25 / 2 / count + 1e-9 : 1e-12;
      CHECK((end.x - x).norm() <= allowed);
      CHECK((end.v - start.v - 0.5 * loads.force_W).norm() < 1e-9);
    }
  }
}

TEST_CASE("E7: velocity Verlet keeps its order where the force depends on the velocity") {
  // With a(x1, v0) in the second kick it is of order 1. Linear drag, c = 1, t = 2 s.
  FlightLoads loads;
  loads.drag.linear = 1;
  Flight start;
  start.v = {1, 0, 0};
  const double order =
      measured_order(*find_scheme("stoermer_verlet"), start, {}, loads, 2, 64,
                     [](const Flight& end) { return std::abs(end.v.x() - std::exp(-2.0)); });
  CHECK(order == Approx(2).margin(0.05));
}

TEST_CASE("E8: implicit Euler solves its equations, and damps") {
  // Printed as if it were a formula. The end must satisfy x1 = x + h v1, v1 = v + h F(x1, v1) / m,
  // W1 = W + h J^-1 (M1 - W1 x J W1), with a step so long that one Newton step does not.
  const Anchor anchor{{0.1, 0, 0}, {-3, 0, 0}, 1e4, 5, 3};
  FlightLoads loads;
  loads.anchors = std::span(&anchor, 1);
  loads.torque_W = {0.1, 0.2, -0.1};
  loads.drag = {0.2, 0.3, 0.01};
  Flight start;
  start.x = {0.2, 0.1, 0};
  start.v = {3, -2, 1};
  start.w = {10, 20, 30};
  const double h = 0.05;
  const Flight end = run(*find_scheme("implicit_euler"), start, kBox, loads, h, 1);
  CHECK((end.x - start.x - h * end.v).norm() < 1e-14);
  const Vector arm = end.q * anchor.point_B;
  const Vector d = end.x + arm - anchor.point_W;
  const Vector n = d.normalized();
  const Vector pull = -(1e4 * (d.norm() - 3) + 5 * n.dot(end.v + end.w.cross(arm))) * n;
  const Vector force = pull - (0.2 + 0.3 * end.v.norm()) * end.v;
  CHECK((end.v - start.v - h * force).norm() < 1e-10);
  const Vector W = end.q.conjugate() * end.w;
  const Vector M = end.q.conjugate() * (loads.torque_W + arm.cross(pull) - 0.01 * end.w);
  const Vector& J = kBox.moments;
  CHECK((J.cwiseProduct(W - start.w) - h * (M - W.cross(J.cwiseProduct(W)))).norm() < 1e-11);
  CHECK(angle(end.q, rotation_exp(h * W)) < 1e-13);
}

TEST_CASE("E9: the default gains no energy where explicit Euler does") {
  // Ten turns of an oscillator with h omega = 0.1: explicit Euler grows by sqrt(1.01) a step.
  const Anchor anchor{Vector::Zero(), {-3, 0, 0}, 100, 0, 3};
  FlightLoads loads;
  loads.anchors = std::span(&anchor, 1);
  Flight start;
  start.x = {0.01, 0, 0};
  const auto energy = [&](const char* scheme) {
    const Flight end = run(*find_scheme(scheme), start, {}, loads, 6.28, 628);
    return (100 * end.x.squaredNorm() + end.v.squaredNorm()) / 0.01;
  };
  CHECK(energy("explicit_euler") == Approx(std::pow(1.01, 628)).epsilon(1e-9));
  CHECK(WorldSettings{}.scheme == "exact");
  CHECK(energy("exact") == Approx(1).epsilon(1e-3));
  CHECK(energy("exact") <= 1);
}

}  // namespace cradle
