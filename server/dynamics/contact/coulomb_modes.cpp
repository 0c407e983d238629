// Every combination of opening, sticking and sliding points, each by its own equations.
//
// For a point that     there is              and it must come out that
//   opens              lambda = 0            un >= 0
//   sticks             u = 0                 ln >= 0, |lt| <= mu ln
//   slides along d     un = 0, lt = -mu ln d ln >= 0, ut = |ut| d
// The laws of coulomb_problem.h, case by case; so what comes out is a solution, by the true cone,
// whatever way led there. In the plane d = 1 or -1 is two cases, and all equations are linear. In
// space d is an unknown unit vector: Newton on all lambda and d, which turn by d + phi d' (d'
// across it), with d' . ut = 0, from four starts a mode: along b, and turned by 90 degrees.
//   d(lt) / d(phi) = -mu ln d',  d(d' . ut) / d(phi) = d' . (W lt')_t - d . ut
// Without friction a point opens or presses (ut is free). Scaled as in ScaledCoulomb.
//
// Cost: 2^m, 3^m, 4^m solutions of up to 3 m equations: for m = 8 in the plane 0.2 s.
#include "server/dynamics/contact/coulomb_modes.h"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>

namespace cradle {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

/// All of the scaled problem, without unit.
struct ModeTolerances {
  double law = 1e-9;        ///< what a condition may miss by rounding ("agree in space")
  double singular = 1e-10;  ///< of the largest pivot of the equations ("agree in the plane")
  double newton = 1e-13;    ///< a step that ends the iteration
  int newton_max = 30;      ///< from near by it takes five
  double distinct = 1e-6;   ///< velocities that are others
};
constexpr ModeTolerances kModeTolerances;

enum class Mode { opens, presses, sticks, slides, slides_back };

class Trial {
 public:
  Trial(const CoulombProblem& problem, const std::vector<Mode>& modes)
      : problem_(problem), modes_(modes), lambda_(VectorXd::Zero(problem.rows())) {
    for (Index i = 0; i < problem.points(); ++i) {
      first_.push_back(unknowns_);
      unknowns_ += count(i);
    }
  }

  bool slides_in_space() const {
    if (problem_.tangents == 1) return false;
    return std::find(modes_.begin(), modes_.end(), Mode::slides) != modes_.end();
  }
  bool is_singular() const { return is_singular_; }
  const VectorXd& lambda() const { return lambda_; }

  /// True if the mode obeys the laws. `way` turns the start: one of four right angles.
  bool holds(int way) {
    start(way);
    const int steps = slides_in_space() ? kModeTolerances.newton_max : 1;
    for (int k = 0; k < steps; ++k) {
      double step = 0;
      if (!improve(step)) return false;
      if (step < kModeTolerances.newton) break;
    }
    return obeys_laws();
  }

 private:
  Mode mode(Index i) const { return modes_[static_cast<std::size_t>(i)]; }
  bool slides(Index i) const { return mode(i) == Mode::slides || mode(i) == Mode::slides_back; }
  Index first(Index i) const { return first_[static_cast<std::size_t>(i)]; }
  Index count(Index i) const {
    if (mode(i) == Mode::opens) return 0;
    if (mode(i) == Mode::sticks) return 1 + problem_.tangents;
    return slides(i) ? problem_.tangents : 1;
  }

  void start(int way) {
    ways_.resize(static_cast<std::size_t>(problem_.points()), Vector2d::UnitX());
    ln_ = VectorXd::Zero(problem_.points());
    lambda_.setZero();
    for (Index i = 0; i < problem_.points(); ++i) {
      Vector2d& d = ways_[static_cast<std::size_t>(i)];
      if (problem_.tangents == 1) {
        d = Vector2d(mode(i) == Mode::slides ? 1 : -1, 0);
        continue;
      }
      d = problem_.b.segment<2>(problem_.row(i) + 1);
      d = d.isZero(0) ? Vector2d::UnitX() : Vector2d(d.normalized());
      for (int k = 0; k < way; ++k) d = Vector2d(-d.y(), d.x());
    }
  }

  /// The column of an unknown: how the impulses change with it.
  void set_columns(MatrixXd& G) const {
    G.setZero(problem_.rows(), unknowns_);
    for (Index i = 0; i < problem_.points(); ++i) {
      if (mode(i) == Mode::opens) continue;
      const Index row = problem_.row(i), column = first(i), t = problem_.tangents;
      G(row, column) = 1;
      if (mode(i) == Mode::sticks) G.block(row + 1, column + 1, t, t).setIdentity();
      if (!slides(i)) continue;
      const Vector2d& d = ways_[static_cast<std::size_t>(i)];
      const double mu = problem_.friction[i];
      G.block(row + 1, column, t, 1) = -mu * d.head(t);
      if (t > 1) G.block<2, 1>(row + 1, column + 1) = -mu * ln_[i] * Vector2d(-d.y(), d.x());
    }
  }

  /// One Newton step on all unknowns; without slides in space the solution.
  bool improve(double& size) {
    MatrixXd G;
    set_columns(G);
    const VectorXd u = problem_.velocities(lambda_);
    const MatrixXd WG = problem_.W * G;
    MatrixXd A(unknowns_, unknowns_);
    VectorXd r(unknowns_);
    for (Index i = 0; i < problem_.points(); ++i) {
      const Index row = problem_.row(i), place = first(i), many = count(i);
      const bool turns = slides(i) && problem_.tangents > 1;
      const Index plain = turns ? 1 : many;
      A.middleRows(place, plain) = WG.middleRows(row, plain);
      r.segment(place, plain) = u.segment(row, plain);
      if (!turns) continue;
      const Vector2d d = ways_[static_cast<std::size_t>(i)], across(-d.y(), d.x());
      const Vector2d ut = u.segment<2>(row + 1);
      A.row(place + 1) = across.transpose() * WG.middleRows<2>(row + 1);
      A(place + 1, place + 1) -= d.dot(ut);
      r[place + 1] = across.dot(ut);
    }
    if (unknowns_ == 0) return true;
    const Eigen::PartialPivLU<MatrixXd> lu(A);
    const auto pivots = lu.matrixLU().diagonal().cwiseAbs();
    if (!(pivots.minCoeff() > kModeTolerances.singular * pivots.maxCoeff())) {
      is_singular_ = true;
      return false;
    }
    const VectorXd step = lu.solve(-r);
    size = step.cwiseAbs().maxCoeff();
    take(step);
    return lambda_.allFinite();
  }

  void take(const VectorXd& step) {
    for (Index i = 0; i < problem_.points(); ++i) {
      const Index row = problem_.row(i), place = first(i), t = problem_.tangents;
      if (mode(i) == Mode::opens) continue;
      ln_[i] += step[place];
      lambda_[row] = ln_[i];
      if (mode(i) == Mode::sticks) lambda_.segment(row + 1, t) += step.segment(place + 1, t);
      if (!slides(i)) continue;
      Vector2d& d = ways_[static_cast<std::size_t>(i)];
      if (t > 1) d = (d + step[place + 1] * Vector2d(-d.y(), d.x())).normalized();
      lambda_.segment(row + 1, t) = -problem_.friction[i] * ln_[i] * d.head(t);
    }
  }

  bool obeys_laws() const {
    const VectorXd u = problem_.velocities(lambda_);
    const double least = -kModeTolerances.law;
    for (Index i = 0; i < problem_.points(); ++i) {
      const Index row = problem_.row(i), t = problem_.tangents;
      const double un = u[row], mu = problem_.friction[i];
      const VectorXd ut = u.segment(row + 1, t), lt = lambda_.segment(row + 1, t);
      if (!(un >= least && ln_[i] >= least)) return false;
      if (mode(i) != Mode::opens && !(un <= -least)) return false;
      if (mode(i) == Mode::sticks && !(lt.norm() <= mu * ln_[i] - least)) return false;
      if (!slides(i)) continue;
      const double along = ut.dot(ways_[static_cast<std::size_t>(i)].head(t));
      if (!(along >= least && ut.norm() - along <= -least)) return false;
    }
    return true;
  }

  const CoulombProblem& problem_;
  const std::vector<Mode>& modes_;
  VectorXd lambda_, ln_;
  std::vector<Index> first_;  // unknown of each point
  std::vector<Vector2d> ways_;
  Index unknowns_ = 0;
  bool is_singular_ = false;
};

/// What a point may do.
std::vector<Mode> choices(const CoulombProblem& problem, Index i) {
  if (problem.friction[i] == 0) return {Mode::opens, Mode::presses};
  if (problem.tangents > 1) return {Mode::opens, Mode::sticks, Mode::slides};
  return {Mode::opens, Mode::sticks, Mode::slides, Mode::slides_back};
}

}  // namespace

CoulombModes find_modes(const CoulombProblem& problem, bool only_one) {
  assert(problem.points() <= kModePoints);
  const ScaledCoulomb scaled(problem);
  const auto points = static_cast<std::size_t>(problem.points());
  CoulombModes found;
  bool any_slides_in_space = false;
  std::vector<Mode> modes(points);
  std::vector<Eigen::VectorXd> distinct;
  std::int64_t combinations = 1;
  for (Index i = 0; i < problem.points(); ++i) {
    combinations *= static_cast<std::int64_t>(choices(problem, i).size());
  }
  for (std::int64_t number = 0; number < combinations; ++number) {
    std::int64_t rest = number;
    for (std::size_t i = 0; i < points; ++i) {
      const std::vector<Mode> may = choices(problem, static_cast<Index>(i));
      modes[i] = may[static_cast<std::size_t>(rest) % may.size()];
      rest /= static_cast<std::int64_t>(may.size());
    }
    Trial trial(scaled.problem, modes);
    ++found.tried;
    any_slides_in_space |= trial.slides_in_space();
    for (int way = 0; way < (trial.slides_in_space() ? 4 : 1); ++way) {
      if (!trial.holds(way)) continue;
      const VectorXd u = scaled.problem.velocities(trial.lambda());
      const bool is_known = std::any_of(distinct.begin(), distinct.end(), [&](const VectorXd& v) {
        return (u - v).cwiseAbs().maxCoeff() < kModeTolerances.distinct;
      });
      if (is_known) continue;
      distinct.push_back(u);
      found.impulses.push_back(scaled.impulses(trial.lambda()));
      found.velocities.push_back(problem.velocities(found.impulses.back()));
      if (only_one) return found;
    }
    found.singular += trial.is_singular() ? 1 : 0;
  }
  found.is_complete = found.singular == 0 && !any_slides_in_space;
  return found;
}

}  // namespace cradle
