#include "tests/bench/conservation.h"

#include <algorithm>
#include <cmath>

#include "tests/bench/masses.h"
#include "tests/bench/measure.h"

namespace cradle::bench {
namespace {

// Gains below this are the rounding of sums, and must not hide a loss.
constexpr double kEnergyRounding = 1e-12;

double relative(double change, double whole) { return change == 0 ? 0 : change / whole; }

}  // namespace

Budget budget(const Scene& scene, std::span<const BodyState> states) {
  const Vector g_W = to_eigen(scene.settings.gravity_W);
  Budget sum;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const BodySpec& body = scene.bodies[i];
    if (body.kind != BodyKind::dynamic) continue;
    const BodyMass of = mass_of(scene, body);
    const double m = of.mass_kg;
    const Rotation q = to_eigen(states[i].q_WB);
    const Vector x = to_eigen(states[i].p_WBo) + q * of.p_BoBcm;
    const Vector v = to_eigen(states[i].v_WBcm);
    const Vector w_B = q.conjugate() * to_eigen(states[i].w_WB);
    const Vector angular = x.cross(m * v) + q * (of.J_kgm2 * w_B);

    sum.translational_J += m * v.squaredNorm() / 2;
    sum.rotational_J += w_B.dot(of.J_kgm2 * w_B) / 2;
    sum.potential_J -= m * g_W.dot(x);
    sum.momentum_Ns += m * v;
    sum.momentum_sum_Ns += m * v.norm();
    sum.angular_momentum_Nms += angular;
    sum.angular_momentum_sum_Nms += angular.norm();
  }
  return sum;
}

Budget budget_at_start(const Scene& scene) {
  std::vector<BodyState> states;
  for (const BodySpec& body : scene.bodies) {
    BodyState state;
    state.p_WBo = body.p_WBo;
    state.q_WB = to_plain(to_eigen(body.q_WB).normalized());
    state.v_WBcm = body.v_WBcm;
    state.w_WB = body.w_WB;
    states.push_back(state);
  }
  return budget(scene, states);
}

Drift::Drift(const Scene& scene) : start_(budget_at_start(scene)) {
  isolated_ = scene.settings.gravity_W == Vec3{} &&
              std::all_of(scene.bodies.begin(), scene.bodies.end(),
                          [](const BodySpec& body) { return body.kind == BodyKind::dynamic; });
}

void Drift::tick(const Budget& now) {
  last_energy_ = (now.energy_J() - start_.energy_J()) / std::abs(start_.energy_J());
  largest_energy_ = worse(last_energy_, largest_energy_);

  const double linear = relative((now.momentum_Ns - start_.momentum_Ns).norm(),
                                 std::max(start_.momentum_sum_Ns, now.momentum_sum_Ns));
  const double angular =
      relative((now.angular_momentum_Nms - start_.angular_momentum_Nms).norm(),
               std::max(start_.angular_momentum_sum_Nms, now.angular_momentum_sum_Nms));
  momentum_ = worse(momentum_, worse(linear, angular));
}

std::optional<double> Drift::energy() const {
  if (start_.energy_J() == 0) return std::nullopt;
  return largest_energy_ <= kEnergyRounding ? last_energy_ : largest_energy_;
}

std::optional<double> Drift::momentum() const {
  if (!isolated_) return std::nullopt;
  return momentum_;
}

}  // namespace cradle::bench
