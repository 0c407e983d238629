// When balls meet.
//
// Two of them are on straight lines seen from each other: with d and u their distance and relative
// velocity, |d + u t| = R is a quadratic, whose stable root is t = C / (-B + sqrt(B^2 - A C)),
// A = u . u, B = d . u, C = d . d - R^2.
// A convex obstacle lies behind the plane through its nearest point, so the time when a ball on its
// parabola meets that plane (a quadratic, too) is never late; repeated from there it converges
// from below, at once on a face and as Newton's method does on edges (conservative advancement,
// Mirtich 1996, with the acceleration in closed form).
#include "server/dynamics/impact/balls.h"

#include <algorithm>
#include <cmath>

#include "server/collision/index.h"

namespace cradle {
namespace {

/// Roundings of positions, of their size: closer is touching.
constexpr double kTouching = 1e-14;
/// Slower approach is none, of the velocities: rounding ("what a bullet strikes").
constexpr double kBallStill = 1e-12;
constexpr int kBallIterationsMax = 64;

NearestPlane plane_of(const Vector& nearest, const Vector& point, double radius) {
  const Vector d = point - nearest;
  const double distance = d.norm();
  if (!(distance > 0)) return {Vector::UnitZ(), 0};
  return {d / distance, std::max(distance - radius, 0.0)};
}

/// The first time from now at which s + v t + a t^2 / 2 falls to 0; s >= 0.
double fall_time(double s, double v, double a) {
  const double root2 = v * v - 2 * a * s;
  if (v < 0) return root2 < 0 ? kNever : 2 * s / (-v + std::sqrt(root2));
  return a < 0 ? (v + std::sqrt(root2)) / -a : kNever;
}

}  // namespace

bool is_obstacle(ShapeKind kind) {
  return kind == ShapeKind::half_space || kind == ShapeKind::box || kind == ShapeKind::sphere ||
         kind == ShapeKind::capsule;
}

NearestPlane nearest_plane(const Obstacle& obstacle, const Vector& point) {
  const Vector p = obstacle.X.R.transpose() * (point - obstacle.X.x);
  switch (obstacle.shape.kind) {
    case ShapeKind::half_space:
      return {obstacle.X.R.col(2), std::max(p.z(), 0.0)};
    case ShapeKind::box: {
      const Vector h = to_eigen(obstacle.shape.half_extents_m());
      const NearestPlane local = plane_of(p.cwiseMax(-h).cwiseMin(h), p, 0);
      return {obstacle.X.R * local.n, local.distance};
    }
    case ShapeKind::capsule: {
      const double l = obstacle.shape.half_length_m();
      const Vector on_axis(0, 0, std::clamp(p.z(), -l, l));
      const NearestPlane local = plane_of(on_axis, p, obstacle.shape.radius_m());
      return {obstacle.X.R * local.n, local.distance};
    }
    default:
      return plane_of(obstacle.X.x, point, obstacle.shape.radius_m());
  }
}

double impact_time(const Ball& a, const Ball& b, double now, double dt) {
  const Vector u = b.v - a.v;
  const Vector d = b.x - a.x + now * u;
  const double B = d.dot(u);
  if (!(B < 0)) return kNever;
  const double R = a.radius + b.radius;
  const double A = u.squaredNorm();
  const double C = d.squaredNorm() - R * R;
  const double D = B * B - A * C, left = dt - now;
  if (D < 0 && C > 0) return kNever;
  // Nor do most that pass: on their way to each other still when the tick ends, and apart.
  if (-B > A * left && (A * left + 2 * B) * left + C > 0) return kNever;
  if (!(B < -kBallStill * R * (a.v.norm() + b.v.norm()))) return kNever;
  if (C <= 0) return now;
  const double time = now + C / (-B + std::sqrt(D));
  return time <= dt ? time : kNever;
}

double impact_time(const Ball& ball, const Obstacle& obstacle, const Vector& gravity, double now,
                   double dt) {
  double t = now;
  for (int k = 0; k < kBallIterationsMax; ++k) {
    const Vector x = ball.x + t * ball.v + 0.5 * t * t * gravity;
    const NearestPlane plane = nearest_plane(obstacle, x);
    const double s = plane.distance - ball.radius;
    const double v = plane.n.dot(ball.v + t * gravity);
    const double a = plane.n.dot(gravity);
    const double touching = kTouching * (ball.radius + x.cwiseAbs().maxCoeff());
    if (s <= touching && v < 0) return v < -kBallStill * ball.v.norm() ? t : kNever;
    t += fall_time(std::max(s, 0.0), v, a);
    if (!(t <= dt)) return kNever;
  }
  return t;
}

double first_time(const BallScene& scene, const BallPair& pair) {
  const Ball& a = scene.balls[index(pair.a)];
  if (pair.b >= 0) return impact_time(a, scene.balls[index(pair.b)], 0, scene.dt);
  return impact_time(a, scene.obstacles[index(~pair.b)], scene.gravity, 0, scene.dt);
}

}  // namespace cradle
