// The convex problem whose minimum the contact solver "newton" takes for an island's velocities.
//
// Sources: Castro, Permenter and Han (2022), "An unconstrained convex formulation of compliant
// contact" (SAP): equations 15 to 30; de Saxce and Feng (1998) for `slip`.
//   min_v  (v - v*)^T M (v - v*) / 2 + sum_points g^T R g / 2,   v* = v + dt M^-1 (loads)
//   g = P(y),  y = held + (target n - slip n - u) / R,  u = J v,  P onto |gt| <= mu gn
//   its gradient, M (v - v*) - J^T g, is 0;  its Hessian is M + J^T G J,  G = (dP/dy) / R
// Unknowns are x = M^1/2 v by body: sqrt(m) v and diag(J)^1/2 R^T w, so that M is 1 and axes about
// which a body does not turn have no column: v = x / sqrt(m), w = S x, S = R diag(J)^-1/2.
// A manifold's points share the relative twist (V, W) of the bodies at their mean c, in the frame
// n, t1, t2:  u = V + W x rho,  F = sum g,  T = sum rho x g.
// Where we differ: R is the same along n and t, and so small (1e-7 of K) that contacts yield by
// nanometres; there is no dissipation.
//
// Cost: a gradient about 0.1 us a manifold.
#include "server/dynamics/contact/newton/contact_island.h"

#include <cmath>

#include "server/collision/index.h"
#include "server/dynamics/contact/friction_cone.h"
#include "server/dynamics/gyroscopic.h"

namespace cradle {
namespace {

using Block = BlockCholesky::Block;

/// What is cold and this near, and not faster apart, is taken to stick: otherwise those that act
/// grow by one layer of a stack an iteration ("stacks of ten and twenty cubes").
constexpr double kNearContact_m = 1e-3;
constexpr double kSlow_mps = 0.01;

Vector wanted(const ContactIsland::Point& point, const Vector& u) {
  Vector y = point.held - u / point.R;
  y.x() += (point.target - point.slip) / point.R;
  return y;
}

}  // namespace

void ContactIsland::begin(const BodyLines& bodies, const BodyArrays& arrays,
                          std::span<const std::int32_t> slots,
                          std::span<ContactConstraint* const> constraints, bool is_flat) {
  is_flat_ = is_flat;
  bodies_.clear();
  manifolds_.clear();
  points_.clear();
  number_.resize(bodies.lines());
  before_.resize(static_cast<Eigen::Index>(6 * slots.size()));
  free_.resize(before_.size());
  for (const std::int32_t slot : slots) add_body(bodies, arrays, slot);
  for (ContactConstraint* c : constraints) add_manifold(bodies, *c);
}

void ContactIsland::add_body(const BodyLines& bodies, const BodyArrays& arrays, std::int32_t slot) {
  const std::int32_t line = bodies.line(slot);
  const std::size_t i = index(slot);
  const Matrix R = arrays.q[i].toRotationMatrix();
  const Vector& yields = arrays.inverse_inertia[i];
  const Vector root = yields.cwiseSqrt();
  Vector inverse_root = Vector::Zero();
  for (int k = 0; k < 3; ++k) inverse_root[k] = root[k] > 0 ? 1 / root[k] : 0;
  const Body body{line, 1 / std::sqrt(arrays.inverse_mass[i]), R * root.asDiagonal(),
                  inverse_root.asDiagonal() * R.transpose(), !yields.isZero(0)};
  const auto at = static_cast<Eigen::Index>(6 * bodies_.size());
  before_.segment<3>(at) = body.root_mass * arrays.v[i];
  before_.segment<3>(at + 3) = body.inverse_S * arrays.w[i];
  free_.segment<3>(at) = body.root_mass * Vector(bodies.v(line));
  free_.segment<3>(at + 3) = body.inverse_S * Vector(bodies.w(line));
  number_[index(line)] = static_cast<std::int32_t>(bodies_.size());
  bodies_.push_back(body);
}

ContactIsland::Side ContactIsland::side(const BodyLines& bodies, std::int32_t slot,
                                        const Vector& arm, const Rotation& turn, const Manifold& m,
                                        Twist& driven, double sign) const {
  const std::int32_t line = bodies.line(slot);
  Matrix turned = m.frame, lever;  // e . (w x arm) = (arm x e) . w
  for (int k = 0; k < 3; ++k) lever.row(k) = arm.cross(m.frame.row(k).transpose()).transpose();
  if (m.c->is_ahead && bodies.tumbles(line)) {
    turned = m.frame * turn.toRotationMatrix();
    lever = lever * turn.toRotationMatrix();
  }
  if (!bodies.yields(line)) {
    driven.head<3>() += sign * (m.frame * bodies.v(line) + lever * bodies.w(line));
    driven.tail<3>() += sign * (turned * bodies.w(line));
    return {-1, 0, Matrix::Zero(), Matrix::Zero()};
  }
  const std::int32_t number = number_[index(line)];
  const Body& body = bodies_[index(number)];
  return {number, 1 / body.root_mass, lever.lazyProduct(body.S), turned.lazyProduct(body.S)};
}

void ContactIsland::add_manifold(const BodyLines& bodies, ContactConstraint& c) {
  if (c.count == 0) return;
  Manifold& m = manifolds_.emplace_back();
  m.c = &c;
  m.frame << c.n.transpose(), c.t1.transpose(), c.t2().transpose();
  Vector arm_A = Vector::Zero();
  for (const ConstraintPoint& p : c.used()) arm_A += p.rA;
  arm_A /= static_cast<double>(c.count);
  const Vector arm_B = arm_A + c.from_B;
  m.driven.setZero();
  m.A = side(bodies, c.a, arm_A, c.turn_A, m, m.driven, -1);
  m.B = side(bodies, c.b, arm_B, c.turn_B, m, m.driven, 1);
  m.first = points_.size();
  m.count = static_cast<std::size_t>(c.count);
  for (ConstraintPoint& p : c.used()) {
    Point& point = points_.emplace_back();
    point.p = &p;
    point.rho = m.frame * (p.rA - arm_A);
    if (is_flat_) point.rho.x() = 0;
    const Vector twist(0, point.rho.z(), -point.rho.y());  // of a unit along n: rho x n
    const auto yields = [&](const Side& side) {
      const Vector w = side.lever.row(0).transpose() + side.turn.transpose() * twist;
      return side.share * side.share + w.squaredNorm();
    };
    point.K = yields(m.A) + yields(m.B);
    point.gap = p.s0;
  }
}

void ContactIsland::store(const Eigen::VectorXd& x, std::span<BodyLine> lines) const {
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    const Body& body = bodies_[k];
    const auto at = static_cast<Eigen::Index>(6 * k);
    BodyLine& line = lines[index(body.line)];
    linear(line) = x.segment<3>(at) / body.root_mass;
    if (body.turns) angular(line) = body.S * x.segment<3>(at + 3);
  }
}

double ContactIsland::speed(const Eigen::VectorXd& x, std::size_t k) const {
  const auto at = static_cast<Eigen::Index>(6 * k);
  return (x.segment<3>(at).norm() + x.segment<3>(at + 3).norm()) / bodies_[k].root_mass;
}

ContactIsland::Twist ContactIsland::twist(const Manifold& m, const Eigen::VectorXd& x) const {
  Twist t = Twist::Zero();
  Vector v = Vector::Zero();
  const auto add = [&](const Side& side, double sign) {
    if (side.body < 0) return;
    const auto linear = x.segment<3>(6 * side.body), angular = x.segment<3>(6 * side.body + 3);
    v += sign * side.share * linear;
    t.head<3>() += sign * (side.lever * angular);
    t.tail<3>() += sign * (side.turn * angular);
  };
  add(m.A, -1);
  add(m.B, 1);
  t.head<3>() += m.frame * v;
  return t;
}

void ContactIsland::set_yield(double R) {
  for (Point& point : points_) point.R = R * point.K;
}

void ContactIsland::look(const Eigen::VectorXd& x) {
  const bool is_still = x.isZero(0);  // as in most ticks of what rests
  for (const Manifold& m : manifolds_) {
    const Twist t = is_still ? m.driven : Twist(twist(m, x) + m.driven);
    const Vector V = t.head<3>(), W = t.tail<3>();
    for (Point& point : of(m)) point.u = V + W.cross(point.rho);
  }
}

void ContactIsland::look_along(const Eigen::VectorXd& d) {
  for (const Manifold& m : manifolds_) {
    const Twist t = twist(m, d);
    const Vector V = t.head<3>(), W = t.tail<3>();
    for (Point& point : of(m)) point.du = V + W.cross(point.rho);
  }
}

void ContactIsland::go(double part) {
  for (Point& point : points_) point.u += part * point.du;
}

void ContactIsland::add_wrench(const Manifold& m, const Side& side, const Vector& F,
                               const Vector& T, double sign, Eigen::VectorXd& r) {
  if (side.body < 0) return;
  r.segment<3>(6 * side.body) += sign * side.share * (m.frame.transpose() * F);
  r.segment<3>(6 * side.body + 3) +=
      sign * (side.lever.transpose() * F + side.turn.transpose() * T);
}

void ContactIsland::gradient(const Eigen::VectorXd& x, Eigen::VectorXd& r) {
  r = x - free_;
  for (const Manifold& m : manifolds_) {
    Vector F = Vector::Zero(), T = Vector::Zero();
    for (Point& point : of(m)) {
      point.g = on_cone(wanted(point, point.u), m.c->friction).g;
      F += point.g;
      T += point.rho.cross(point.g);
    }
    if (F.x() == 0) continue;
    add_wrench(m, m.A, F, T, 1, r);
    add_wrench(m, m.B, F, T, -1, r);
  }
}

double ContactIsland::slope_of_contacts(double part) const {
  double sum = 0;
  for (const Manifold& m : manifolds_) {
    for (const Point& point : of(m)) {
      const Vector u = point.u + part * point.du;
      sum -= on_cone(wanted(point, u), m.c->friction).g.dot(point.du);
    }
  }
  return sum;
}

namespace {

bool is_cold_contact(const ContactIsland::Point& point) {
  return point.gap < kNearContact_m && point.u.x() < point.target - point.slip + kSlow_mps;
}

}  // namespace

bool ContactIsland::acts(const Manifold& m, bool is_cold) const {
  for (const Point& point : of(m)) {
    if (is_cold && is_cold_contact(point)) return true;
    if (point.g.x() > 0) return true;
  }
  return false;
}

/// Of the wrench at the manifold's centre against the twist there: sum P^T G P, P = (1, -[rho]x).
Block ContactIsland::stiffness(const Manifold& m, bool is_cold) const {
  Block sum = Block::Zero();
  for (const Point& point : of(m)) {
    const Vector y = wanted(point, point.u);
    const double mu = m.c->friction;
    Matrix G = cone_derivative(y, mu);
    if (is_cold && G.isZero(0) && is_cold_contact(point)) {
      G(0, 0) = 1;
      if (mu > 0) G(1, 1) = G(2, 2) = 1;
    }
    G /= point.R;
    const Matrix across = cross_matrix(point.rho), G_across = G * across;
    sum.topLeftCorner<3, 3>() += G;
    sum.topRightCorner<3, 3>() -= G_across;
    sum.bottomRightCorner<3, 3>() -= across * G_across;
  }
  sum.bottomLeftCorner<3, 3>() = sum.topRightCorner<3, 3>().transpose();
  return sum;
}

void ContactIsland::assemble(BlockCholesky& H, bool is_cold) {
  active_.clear();
  pairs_.clear();
  for (std::size_t k = 0; k < manifolds_.size(); ++k) {
    const Manifold& m = manifolds_[k];
    if (!acts(m, is_cold)) continue;
    active_.push_back(k);
    if (m.A.body >= 0 && m.B.body >= 0) pairs_.push_back({m.A.body, m.B.body});
  }
  H.analyse(bodies_.size(), pairs_);
  H.set_zero();
  const auto jacobian = [](const Manifold& m, const Side& side) {
    Block J;
    J << side.share * m.frame, side.lever, Matrix::Zero(), side.turn;
    return J;
  };
  std::size_t pair = 0;
  for (const std::size_t k : active_) {
    const Manifold& m = manifolds_[k];
    const Block G = stiffness(m, is_cold);
    Block J_A, J_B;
    if (m.A.body >= 0) {
      J_A = jacobian(m, m.A);
      H.add(m.A.body, J_A.transpose() * (G * J_A));
    }
    if (m.B.body < 0) continue;
    J_B = jacobian(m, m.B);
    const Block GJ = G * J_B;
    H.add(m.B.body, J_B.transpose() * GJ);
    if (m.A.body >= 0) H.add_pair(pair++, -J_A.transpose() * GJ);
  }
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    H.add(static_cast<std::int32_t>(k), Block::Identity());
  }
}

}  // namespace cradle
