#include "server/dynamics/contact/contact_system.h"

#include <Eigen/LU>

#include "server/dynamics/gyroscopic.h"

namespace cradle {
namespace {

ContactSystem::Side side_of(std::int32_t slot, const Vector& arm, const Rotation& turn,
                            const Matrix& inverse_inertia, double inverse_mass, const Matrix& E,
                            const ContactConstraint& c, const BodyLines& bodies) {
  const std::int32_t line = bodies.line(slot);
  const bool is_turned = c.is_ahead && bodies.tumbles(line);
  const Matrix T = is_turned ? Matrix(turn.toRotationMatrix()) : Matrix::Identity();
  const Matrix lever = cross_matrix(arm) * E;  // L = lever^T T
  return {line, inverse_mass, lever.transpose() * T, T.transpose() * (inverse_inertia * lever)};
}

/// What an impulse at `by`'s side does to the velocity at `at`'s, if it is the same body.
Matrix response(const ContactSystem::Point& at, const ContactSystem::Side& side_at,
                const ContactSystem::Point& by, const ContactSystem::Side& side_by) {
  if (side_at.line != side_by.line || side_by.inverse_mass == 0) return Matrix::Zero();
  return side_by.inverse_mass * (at.E.transpose() * by.E) + side_at.L * side_by.turn;
}

Matrix response(const ContactSystem::Point& at, const ContactSystem::Point& by) {
  return response(at, at.A, by, by.A) + response(at, at.B, by, by.B) -
         response(at, at.A, by, by.B) - response(at, at.B, by, by.A);
}

}  // namespace

void ContactSystem::begin(const ContactTick& tick, const BodyArrays& arrays,
                          std::span<ContactConstraint* const> constraints,
                          const BodyLines& bodies) {
  islands_.find(tick, arrays.x.size(), constraints);
  sizes_.assign(islands_.count(), 0);
  for (std::size_t k = 0; k < tick.moving.size(); ++k) {
    ++sizes_[islands_.of(static_cast<std::int32_t>(k))];
  }
  firsts_.assign(islands_.count() + 1, 0);
  for (std::size_t k = 0; k < constraints.size(); ++k) {
    firsts_[islands_.of_constraint(k) + 1] += constraints[k]->used().size();
  }
  for (std::size_t i = 0; i < islands_.count(); ++i) firsts_[i + 1] += firsts_[i];
  points_.resize(firsts_.back());
  std::vector<std::size_t> next(firsts_);
  for (std::size_t k = 0; k < constraints.size(); ++k) {
    ContactConstraint& c = *constraints[k];
    find_effective_masses(c);
    Matrix E;
    E << c.n, c.t1, c.t2();
    for (ConstraintPoint& p : c.used()) {
      Point& point = points_[next[islands_.of_constraint(k)]++];
      point.c = &c;
      point.p = &p;
      point.E = E;
      point.bias = 0;
      point.acts = true;
      point.A = side_of(c.a, p.rA, c.turn_A, *c.inverse_inertia_A, c.inverse_mass_A, E, c, bodies);
      point.B =
          side_of(c.b, c.rB(p), c.turn_B, *c.inverse_inertia_B, c.inverse_mass_B, E, c, bodies);
      const Matrix K = response(point, point);
      point.K = K.diagonal();
      point.inverse_K = K.inverse();
    }
  }
}

Vector ContactSystem::velocity(const Point& point, const BodyLine* lines) {
  const BodyLine &A = lines[point.A.line], &B = lines[point.B.line];
  return point.E.transpose() * (linear(B) - linear(A)) + point.B.L * angular(B) -
         point.A.L * angular(A);
}

void ContactSystem::push(const Point& point, const Vector& impulse, BodyLine* lines) {
  const Vector along = point.E * impulse;
  const auto give = [&](const Side& side, double sign) {
    if (side.inverse_mass == 0) return;
    linear(lines[side.line]) += sign * side.inverse_mass * along;
    angular(lines[side.line]) += sign * (side.turn * impulse);
  };
  give(point.A, -1);
  give(point.B, 1);
}

double ContactSystem::separation(const Point& point, const BodyLines& bodies) {
  const Vector way =
      bodies.dp(point.B.line) + Vector(bodies.theta(point.B.line)).cross(point.c->rB(*point.p)) -
      bodies.dp(point.A.line) - Vector(bodies.theta(point.A.line)).cross(point.p->rA);
  return point.p->s0 + point.c->n.dot(way);
}

CoulombProblem ContactSystem::problem(Points points, const BodyLine* lines) {
  const auto count = static_cast<Eigen::Index>(points.size());
  CoulombProblem problem{Eigen::MatrixXd(3 * count, 3 * count), Eigen::VectorXd(3 * count),
                         Eigen::VectorXd(count), 2};
  for (Eigen::Index i = 0; i < count; ++i) {
    const Point& at = points[static_cast<std::size_t>(i)];
    problem.friction[i] = at.c->friction;
    problem.b.segment<3>(3 * i) = velocity(at, lines) + Vector(at.bias, 0, 0);
    for (Eigen::Index j = 0; j < count; ++j) {
      problem.W.block<3, 3>(3 * i, 3 * j) = response(at, points[static_cast<std::size_t>(j)]);
    }
  }
  return problem;
}

}  // namespace cradle
