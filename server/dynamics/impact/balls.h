/// Balls that only fall, and what stands in their way.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "server/collision/collider.h"

namespace cradle {

/// Its centre of mass is its middle, its moments are equal. Between impacts it is at
/// x + v t + g t^2 / 2, with t counted from the tick's beginning: an impact changes x, too, so that
/// two balls are always on straight lines seen from each other. It fits one line of memory.
struct Ball {
  alignas(64) Vector x;  ///< m
  Vector v;              ///< m/s
  double radius = 0;     ///< m
  int impacts = 0;       ///< in this tick
};
static_assert(sizeof(Ball) == 64);

/// A ball that was struck in this tick, and what an impact asks of it beside. Few are.
struct StruckBall {
  StruckBall(std::int32_t which, const Ball& start) : ball(start), number(which) {}

  Ball ball;                             ///< as it goes since the last impact
  Vector w;                              ///< rad/s
  Rotation turn = Rotation::Identity();  ///< where it is, as if it had turned by w always
  Vector held = Vector::Zero();  ///< m/s^2: of gravity, what obstacles that it rests on hold
                                 ///< until the tick ends
  double inverse_mass = 0;       ///< 1/kg
  double inverse_inertia = 0;    ///< 1/(kg m^2)
  Aabb known;                    ///< what it may meet in here, it knows
  std::int32_t number = 0;
};

/// A static convex body: half-space, box, sphere or capsule.
struct Obstacle {
  Shape shape;
  Pose X;
};

/// Whether balls know the way to it.
bool is_obstacle(ShapeKind kind);

/// Where an obstacle is nearest to a point: the plane through it that separates them.
struct NearestPlane {
  Vector n = Vector::UnitZ();  ///< towards the point
  double distance = 0;         ///< m; 0 inside
};
NearestPlane nearest_plane(const Obstacle& obstacle, const Vector& point);

/// Of two balls, or a ball and an obstacle: `a` and `b` are numbers of balls, b < 0: obstacle ~b.
struct BallPair {
  std::int32_t a = 0, b = 0;
  double time = std::numeric_limits<double>::infinity();  ///< s, of the impact that is expected
};

/// What a pair's surfaces are to each other.
struct BallMaterial {
  double restitution = 0, friction = 0;
  double rolling_m = 0, torsional_m = 0;  ///< the greatest angular impulses by the normal one
};

/// Contacts closer than this part of the smaller radius are struck at once. Larger would treat
/// separated balls as touching, none would break the symmetry of a triangle that is struck
/// ("a break shot stays symmetric").
inline constexpr double kStruckTogether = 2e-5;

inline constexpr double kNever = std::numeric_limits<double>::infinity();

/// As a tick finds it.
struct BallScene {
  std::vector<Ball> balls;
  std::vector<Obstacle> obstacles;
  Vector gravity = Vector::Zero();  ///< m/s^2
  double dt = 0;                    ///< s
};

/// s from the tick's beginning, not before `now`; kNever if it is later than `dt`.
double impact_time(const Ball& a, const Ball& b, double now, double dt);
double impact_time(const Ball& ball, const Obstacle& obstacle, const Vector& gravity, double now,
                   double dt);
/// Likewise when nobody has been struck yet.
double first_time(const BallScene& scene, const BallPair& pair);

}  // namespace cradle
