#include "server/world/step_report.h"

#include <algorithm>

#include "server/collision/index.h"
#include "server/collision/surface.h"
#include "server/world/state.h"

namespace cradle {

StepReport report_of(const World::State& s) {
  StepReport report;
  report.parts = s.parts;
  report.contacts = s.overlaps.points;
  report.penetration_max_m = s.overlaps.max_m;
  if (report.contacts > 0) report.penetration_mean_m = s.overlaps.sum_m / report.contacts;
  report.islands = s.solved.islands;
  report.pairs = static_cast<std::int64_t>(s.pairs.size());
  report.pair_work = s.culling.boxes_seen + s.culling.nodes_seen;
  report.body_sub_steps = s.solved.body_sub_steps;
  report.sub_steps_max = s.solved.sub_steps_max;
  report.islands_makeshift = s.solved.islands_makeshift;
  report.islands_at_rest = s.solved.islands_at_rest;
  report.islands_by_newton = s.solved.islands_by_newton;
  report.islands_taken_over = s.solved.islands_taken_over;
  report.sag_expected_m = s.solved.sag_max_m;
  const ContactResidual& residual = s.solved.residual;
  report.residual_mps = residual.most.natural_mps;
  report.residual_relative = residual.relative();
  report.residual_signorini_mps = residual.most.signorini_mps;
  report.residual_cone_mps = residual.most.cone_mps;
  report.residual_complementarity_J = residual.most.complementarity_J;
  report.balance = s.balance.tick;
  report.impacts = s.balls.report.impacts;
  report.impacts_ordered = s.balls.report.ordered + s.solved.impacts_ordered;
  report.impacts_spent = s.balls.report.spent;
  report.bodies_in_contact = static_cast<int>(s.moving.size());
  report.springs_unconverged = s.springs_unconverged;
  report.paid_J = s.solved.paid_J;
  report.unsolved = static_cast<int>(std::count(s.unsolved.begin(), s.unsolved.end(), 1));
  report.pairs_by = s.culling.method;
  report.crowded = s.culling.crowded;
  report.impact_searches = s.fast.searches;
  report.stopped_at_impact = s.fast.stopped;
  report.impacts_unresolved = s.fast.unresolved;
  report.spins_cut = s.spins_cut;
  for (std::size_t k = 0; k < s.composites_used && s.surfaces > 1; ++k) {
    const BodyPair& pair = s.pairs[s.composites[k].pair];
    report.surfaces_passing += is_surface(s.bodies.shape[index(pair.a)].kind) &&
                               is_surface(s.bodies.shape[index(pair.b)].kind);
  }
  return report;
}

StepReport joined(const StepReport& first, const StepReport& second) {
  StepReport both = second;
  for (const auto count :
       {&StepReport::islands_makeshift, &StepReport::islands_taken_over, &StepReport::impacts,
        &StepReport::impacts_ordered, &StepReport::impacts_spent, &StepReport::springs_unconverged,
        &StepReport::unsolved, &StepReport::stopped_at_impact, &StepReport::impacts_unresolved,
        &StepReport::spins_cut}) {
    both.*count += first.*count;
  }
  for (const auto count :
       {&StepReport::pair_work, &StepReport::body_sub_steps, &StepReport::impact_searches}) {
    both.*count += first.*count;
  }
  for (const auto worst :
       {&StepReport::penetration_max_m, &StepReport::penetration_mean_m,
        &StepReport::sag_expected_m, &StepReport::residual_mps, &StepReport::residual_relative,
        &StepReport::residual_signorini_mps, &StepReport::residual_cone_mps,
        &StepReport::residual_complementarity_J}) {
    both.*worst = std::max(first.*worst, second.*worst);
  }
  both.sub_steps_max = std::max(first.sub_steps_max, second.sub_steps_max);
  both.bodies_in_contact = std::max(first.bodies_in_contact, second.bodies_in_contact);
  both.crowded = std::max(first.crowded, second.crowded);
  both.paid_J += first.paid_J;
  return both;
}

}  // namespace cradle
