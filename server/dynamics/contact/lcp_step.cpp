// The contact solver "lcp": one step a tick, impulses of each island all at once by Lemke's pivots.
//
// Sources: Stewart and Trinkle (1996), Anitescu and Potra (1997); see coulomb_lcp.cpp for the
// equations, contact_system.h for W and b.
//   v' = v + dt a + M^-1 J^T lambda;  un' + max(s, 0) / dt >= 0, or un' + e un >= 0 where it hits
//   x' = x + dt v'
// Friction has eight directions a point, turned up to kTurns times to where it slides. Overlaps,
// which positions of first order leave, are parted at the tick's end (baseline_tick.h), without a
// velocity.
// Where we differ from the sources: that, and restitution, which is Newton's: a row of balls that
// touch moves as one (P25), and with friction it may give energy.
// Islands of more than kPivotPoints points, and those where pivots find nothing, go to sweeps
// (contact_sweeps.h), and are counted: ContactReport::islands_makeshift.
//
// Order: 1. Cost: the pivots', of ten unknowns a point: a cube on the ground 0.04 ms a tick, a
// stack of four 1.2, of eight 18.
#include "server/dynamics/contact/lcp_step.h"

#include <algorithm>

#include "server/dynamics/contact/baseline_tick.h"
#include "server/dynamics/contact/contact_sweeps.h"
#include "server/dynamics/contact/coulomb_lcp.h"

namespace cradle {
namespace {

constexpr CoulombLcpSettings kPivots{
    .directions = 8, .turns_max = 3, .residual = 1e-9, .give = 1e-8};

class LcpStep final : public ContactSolver {
 public:
  ContactReport advance(const ContactTick& tick, const BodyArrays& arrays,
                        std::span<const Matrix> inverse_inertia_W,
                        std::span<ContactConstraint* const> constraints) override {
    if (constraints.empty()) return {};
    BaselineTick& t = tick_;
    t.begin(tick, arrays, inverse_inertia_W, constraints);
    t.bodies.integrate_velocities(tick.dt, 0);
    for (ContactSystem::Point& point : t.system.points()) set_bias(point);
    for (std::size_t i = 0; i < t.system.islands(); ++i) solve(i);
    t.judge();
    t.add_work(tick.dt);
    t.bodies.integrate_positions(tick.dt, 0);
    t.part_overlaps();
    return t.end(1);
  }

 private:
  void set_bias(ContactSystem::Point& point) const {
    tick_.set_bounce(point);
    const BodyLines& lines = tick_.bodies;
    const double gap_speed = std::max(point.p->s0, 0.0) / tick_.tick.dt;
    const double un = ContactSystem::velocity(point, lines.velocities()).x();
    if (point.bias == 0 || un + gap_speed >= 0) point.bias = gap_speed;
  }

  void solve(std::size_t island) {
    const ContactSystem::Points points = tick_.system.island(island);
    if (points.empty()) return;
    BodyLine* const lines = tick_.bodies.velocities();
    if (points.size() <= kPivotPoints) {
      const CoulombProblem problem = ContactSystem::problem(points, lines);
      const CoulombLcpSolution found = solve_by_lcp(problem, kPivots);
      if (found.status == LcpStatus::solved) {
        std::vector<Vector> impulses;
        for (std::size_t i = 0; i < points.size(); ++i) {
          impulses.push_back(found.impulses.segment<3>(3 * static_cast<Eigen::Index>(i)));
          ContactSystem::push(points[i], impulses[i], lines);
        }
        BaselineTick::keep(points, impulses, tick_.tick.dt);
        return;
      }
    }
    tick_.note_makeshift(island);
    std::vector<Vector> impulses = BaselineTick::forces_of(points, tick_.tick.dt);
    for (std::size_t i = 0; i < points.size(); ++i) {
      ContactSystem::push(points[i], impulses[i], lines);
    }
    sweep(points, impulses, lines);
    BaselineTick::keep(points, impulses, tick_.tick.dt);
  }

  BaselineTick tick_;
};

}  // namespace

std::unique_ptr<ContactSolver> make_lcp_step() { return std::make_unique<LcpStep>(); }

}  // namespace cradle
