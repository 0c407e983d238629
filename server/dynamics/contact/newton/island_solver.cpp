// What an island's convex problem (contact_island.cpp) is made of in a tick, and how its minimum is
// found.
//
// Sources: as contact_island.cpp; Stewart and Trinkle (1996) for gaps; rounds: Rockafellar (1976),
// the proximal method of multipliers, and Cadoux (2009) for the slip.
//   target of a point: -s / dt where there is a gap s; min(-s / dt, kPush_mps) where it overlaps;
//   -e un where it bounces
//   held: friction of the tick before, so that what sticks does not creep
//   slip = mu |ut|, at first that of the velocities before: the convex problem lifts what slides by
//   that much; then of the solution, until it is the same
// Certificate: where the gradient at the velocities before (or at none, if they are as small) is
// within tolerance, these are the solution. So what rests costs one gradient, and does not move.
// Where contacts slide, R is too small for Newton's steps: the cone is curved, and the way along
// its edge is as wide as R g. So there R is larger, and in rounds held = g, slip = mu |ut|, until
// the natural map (contact_balance.h) is small: then contacts do not yield, whatever R is.
// "accurate" goes on in such rounds where contacts stick, too. If they do not end, the best of what
// was found is taken where it is better than kTaken, and counted. What pushes out faster than load
// alone does moves places, but not velocities: those are of a second solution, without it.
//
// Order: 1. Errors at rest: overlap dt R g, and no creep. Cost: newton_step.cpp.
#include "server/dynamics/contact/newton/island_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cradle {
namespace {

constexpr double kPush_mps = 1;       ///< overlaps part no faster: each of them alone, in a second
constexpr double kPushes_mps = 1e-3;  ///< more than load alone does
constexpr double kIslandRestTicks = 2;  ///< as in soft_step.cpp ("bounces off nothing")

constexpr int kDirect = 8;  ///< iterations: what rests takes one
constexpr int kSlips = 4;   ///< changes of slip; one body that slides takes two
constexpr double kSlipEnough_mps = 1e-3;
constexpr int kAccurateRounds = 10;  ///< of "accurate": what rests takes one or two

constexpr double kSofter[] = {1e-2, 1e-3, 1e-4};  ///< R by K, where contacts slide
constexpr int kIterations = 50;
constexpr int kRoundsSliding = 100;
/// Of the velocity that loads give: rounding of places makes 1e-11 of it (a pyramid of 820 cubes).
constexpr double kIslandStill = 1e-9;

constexpr double kTaken = 1e-2;  ///< natural map that is taken, though it is not what is asked for

}  // namespace

bool IslandSolver::solve(const BodyLines& bodies, const BodyArrays& arrays, Island& island,
                         double dt) {
  begin(bodies, arrays, island, dt);
  if (island.constraints.empty()) return true;
  if (!find()) return false;
  way_ = x_;
  if (!is_pushed()) return true;
  stop_pushing();
  x_ = contacts_.before();
  contacts_.look(x_);
  return find();
}

void IslandSolver::begin(const BodyLines& bodies, const BodyArrays& arrays, Island& island,
                         double dt) {
  of_ = &island;
  dt_ = dt;
  is_exact_ = true;
  is_still_ = false;
  iterations_ = 0;
  contacts_.begin(bodies, arrays, island.slots, island.constraints, settings_.is_flat);
  x_ = way_ = contacts_.free();
  if (island.constraints.empty()) return;
  set_targets(bodies);
  tolerance_ = settings_.tolerance;
  scale_ = scale();
  contacts_.set_yield(settings_.yield);
  start();
}

bool IslandSolver::solve_at_rest(const BodyLines& bodies, const BodyArrays& arrays, Island& island,
                                 double dt, const Budget& budget) {
  begin(bodies, arrays, island, dt);
  if (std::isfinite(budget.unbalanced) &&
      minimiser_.error(contacts_, x_) > budget.unbalanced * scale_) {
    return false;
  }
  for (int k = 0; k <= kSlips; ++k) {
    if (!minimise(budget.iterations - iterations_)) return false;
    if (slip_error() <= kSlipEnough_mps) {
      is_still_ = x_.norm() <= kIslandStill * scale_;
      if (is_still_) x_.setZero();
      way_ = x_;
      return !is_pushed();
    }
    update_slip();
  }
  return false;
}

void IslandSolver::store(std::span<BodyLine> ways, std::span<BodyLine> ends) const {
  contacts_.store(way_, ways);
  contacts_.store(x_, ends);
}

void IslandSolver::keep(ContactResidual& residual) {
  contacts_.for_points([&](const ContactIsland::Point& point, ContactConstraint& c) {
    ConstraintPoint& p = *point.p;
    PointImpulse& own = c.impulse(p);
    own.lambda = point.g.x();
    own.lambda_t = point.g.tail<2>();
    p.force = own.lambda / dt_;
    p.force_t = own.lambda_t / dt_;
    p.press = p.force * point.K;
    c.K_normals[c.index(p)] = point.K;
    residual.add(point.K, c.friction, point.g, point.u - Vector(point.target, 0, 0));
  });
}

void IslandSolver::set_targets(const BodyLines& bodies) {
  contacts_.look(contacts_.before());
  bool bounces = false;
  contacts_.for_points([&](ContactIsland::Point& point, const ContactConstraint& c) {
    const double s = point.gap = c.gap(*point.p, dt_ * dt_ * settings_.yield);
    point.target = s > 0 ? -s / dt_ : std::min(-s / dt_, kPush_mps);
    const bool carries = point.p->force > 0;
    point.slip = carries ? c.friction * point.u.tail<2>().norm() : 0;
    if (carries) point.held.tail<2>() = dt_ * point.p->force_t;
    if (carries && settings_.is_always_exact) point.held.x() = dt_ * point.p->force;
    bounces |= c.restitution > 0;
  });
  if (bounces) set_bounces(bodies);
}

/// By velocities after loads; what does not close faster than loads make it in kIslandRestTicks is
/// at rest, and bounces off nothing.
void IslandSolver::set_bounces(const BodyLines& bodies) {
  contacts_.look(contacts_.free());
  contacts_.for_points([&](ContactIsland::Point& point, const ContactConstraint& c) {
    const double pull = std::max(bodies.acceleration(bodies.line(c.a)).norm(),
                                 bodies.acceleration(bodies.line(c.b)).norm());
    const double un = point.u.x();
    if (c.restitution == 0 || un >= point.target || un >= -kIslandRestTicks * dt_ * pull) return;
    point.target = -c.restitution * un;
  });
}

/// Of the unknowns: what moves already, what loads change, what is to part.
double IslandSolver::scale() const {
  const Eigen::VectorXd &before = contacts_.before(), &free = contacts_.free();
  double pushes2 = 0;
  for (const ContactIsland::Point& point : contacts_.points()) {
    const double target = std::max(point.target, 0.0);
    pushes2 = std::max(pushes2, target * target / point.K);
  }
  return std::sqrt((free - before).squaredNorm() + before.squaredNorm() + pushes2);
}

/// What hums within the tolerance comes to rest where that is nearer to the solution.
void IslandSolver::start() {
  x_ = contacts_.before();
  const double size = x_.norm();
  if (size > 0 && size <= tolerance_ * scale_) {
    const double humming = minimiser_.error(contacts_, x_);
    x_.setZero();
    if (minimiser_.error(contacts_, x_) > humming) x_ = contacts_.before();
  }
  contacts_.look(x_);
}

bool IslandSolver::minimise(int iterations_max) {
  const Minimum minimum =
      minimiser_.minimise(contacts_, of_->H, x_, {tolerance_, scale_, iterations_max});
  iterations_ += minimum.iterations;
  return minimum.is_found;
}

bool IslandSolver::find() {
  best_residual_ = std::numeric_limits<double>::infinity();
  contacts_.set_yield(settings_.yield);
  if (find_slip(kDirect)) {
    if (!settings_.is_always_exact || find_by_rounds(settings_.yield, kAccurateRounds)) return true;
  } else if (contacts_.bodies() > settings_.bodies_sliding) {
    return false;
  } else {
    x_ = contacts_.before();
  }
  for (const double yield : kSofter) {
    if (find_by_rounds(yield, kRoundsSliding)) return true;
  }
  x_ = best_;
  contacts_.restore(best_points_);
  is_exact_ = false;
  return best_residual_ <= kTaken;
}

bool IslandSolver::find_by_rounds(double yield, int rounds_max) {
  contacts_.set_yield(yield);
  contacts_.look(x_);
  for (int k = 0; k < rounds_max; ++k) {
    if (!minimise(yield > settings_.yield ? kIterations : kDirect)) break;
    if (keep_better()) return true;
    hold();
    update_slip();
  }
  if (best_residual_ < std::numeric_limits<double>::infinity()) {
    x_ = best_;
    contacts_.restore(best_points_);
    hold();
    update_slip();
  }
  return false;
}

void IslandSolver::hold() {
  for (ContactIsland::Point& point : contacts_.points()) point.held = point.g;
}

/// True where the natural map is small enough.
bool IslandSolver::keep_better() {
  ContactResidual residual;
  contacts_.for_points([&](const ContactIsland::Point& point, const ContactConstraint& c) {
    residual.add(point.K, c.friction, point.g, point.u - Vector(point.target, 0, 0));
  });
  if (residual.relative() < best_residual_) {
    best_residual_ = residual.relative();
    best_ = x_;
    best_points_.assign(contacts_.points().begin(), contacts_.points().end());
  }
  return residual.relative() <= settings_.natural_map;
}

bool IslandSolver::find_slip(int iterations_max) {
  for (int k = 0;; ++k) {
    if (!minimise(iterations_max)) return false;
    if (slip_error() <= kSlipEnough_mps) return true;
    if (k == kSlips) return false;
    update_slip();
  }
}

namespace {

double slip_of(const ContactIsland::Point& point, const ContactConstraint& c) {
  return c.friction * point.u.tail<2>().norm();
}

}  // namespace

void IslandSolver::update_slip() {
  contacts_.for_points([](ContactIsland::Point& point, const ContactConstraint& c) {
    point.slip = slip_of(point, c);
  });
}

double IslandSolver::slip_error() {
  double most = 0;
  contacts_.for_points([&](const ContactIsland::Point& point, const ContactConstraint& c) {
    if (point.g.x() > 0) most = std::max(most, std::abs(slip_of(point, c) - point.slip));
  });
  return most;
}

bool IslandSolver::is_pushed() const {
  return std::ranges::any_of(contacts_.points(), [](const ContactIsland::Point& point) {
    return point.target > kPushes_mps && point.gap < 0 && point.g.x() > 0;
  });
}

/// But bounces stay.
void IslandSolver::stop_pushing() {
  contacts_.for_points([&](ContactIsland::Point& point, const ContactConstraint&) {
    const bool bounces = point.target > -point.gap / dt_;
    if (point.gap < 0 && !bounces) point.target = 0;
  });
}

}  // namespace cradle
