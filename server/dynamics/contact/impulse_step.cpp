// The contact solver "impulse": bodies that overlap are moved apart by the least distance, then
// what touches gets impulses.
//
// Source: Rueth, "Rigid Body Physics", sections III.B and III.D: separation of all bodies of a
// collision at once by a minimal distance, as a linear complementarity problem, then velocities by
// impulses. The law of these is not given there: Newton's restitution, un' = -e un, and Coulomb's
// friction, by sequential impulses (contact_sweeps.h).
//   at the tick's start   0 <= y, s + Wnn y >= 0, y . (s + Wnn y) = 0;  x += M^-1 Jn^T y
//   where s <= kTouching  v' = v + dt a + M^-1 J^T lambda by the laws of contact;  x' = x + dt v'
// Where we differ from the paper: distance is by mass, so that the heavier body moves less, and
// bodies turn where that is shorter; the normal is the contact's, not from centre to centre; its
// force field of infinite strength is left out.
// What it cannot do: it knows no contact before it overlaps, so what falls is inside by up to v dt
// in the tick when it lands; moving bodies apart gives and takes potential energy (a body on a
// slope climbs by what it sank in); sweeps that run out leave impulses unfinished, and are counted:
// ContactReport::islands_makeshift.
//
// Order: 1. Cost: the separation's pivots where something overlaps; up to 200 sweeps of 0.08 us a
// point: a cube on the ground 2.5 us, a stack of ten 0.35 ms.
#include "server/dynamics/contact/impulse_step.h"

#include "server/dynamics/contact/baseline_tick.h"
#include "server/dynamics/contact/contact_sweeps.h"

namespace cradle {
namespace {

/// m: what was moved apart touches, to rounding ("P36").
constexpr double kPointActs_m = 1e-4;

class ImpulseStep final : public ContactSolver {
 public:
  ContactReport advance(const ContactTick& tick, const BodyArrays& arrays,
                        std::span<const Matrix> inverse_inertia_W,
                        std::span<ContactConstraint* const> constraints) override {
    if (constraints.empty()) return {};
    BaselineTick& t = tick_;
    t.begin(tick, arrays, inverse_inertia_W, constraints);
    t.part_overlaps();
    t.bodies.integrate_velocities(tick.dt, 0);
    for (ContactSystem::Point& point : t.system.points()) {
      const double s = ContactSystem::separation(point, t.bodies);
      t.set_bounce(point);
      point.acts = s <= kPointActs_m;
      if (!point.acts) point.bias = s / tick.dt;  // for the residual
    }
    for (std::size_t i = 0; i < t.system.islands(); ++i) solve(i);
    t.judge();
    t.add_work(tick.dt);
    t.bodies.integrate_positions(tick.dt, 0);
    return t.end(1);
  }

 private:
  void solve(std::size_t island) {
    const ContactSystem::Points points = tick_.system.island(island);
    BodyLine* const lines = tick_.bodies.velocities();
    std::vector<Vector> impulses = BaselineTick::forces_of(points, tick_.tick.dt);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!points[i].acts) impulses[i].setZero();
      ContactSystem::push(points[i], impulses[i], lines);
    }
    if (!sweep(points, impulses, lines)) tick_.note_makeshift(island);
    BaselineTick::keep(points, impulses, tick_.tick.dt);
  }

  BaselineTick tick_;
};

}  // namespace

std::unique_ptr<ContactSolver> make_impulse_step() { return std::make_unique<ImpulseStep>(); }

}  // namespace cradle
