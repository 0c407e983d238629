/// How softly a contact gives: the spring and damper that a sub-step of the soft step stands for.
///
/// Symbols: h sub-step, s; omega = 2 pi c / h, with c the contact frequency by sub-step; zeta the
/// damping ratio.
///   a1 = 2 zeta + h omega, a2 = h omega a1
///   mass scale ms = a2 / (1 + a2), impulse scale is = 1 / (1 + a2), bias rate br = omega / a1
/// Source: Catto (2024), "Solver2D".
#pragma once

namespace cradle {

struct Softness {
  double mass_scale, impulse_scale;
  double bias_rate;  ///< 1/s
};

/// `h`: the sub-step, s.
Softness softness_of(double h);

/// 2 pi c: a contact without preload under a load that gives its effective mass the acceleration a
/// sinks in by a (h / contact_angle())^2.
double contact_angle();
/// s^2: by so much of that, with so many sub-steps in a tick.
double give_of(int sub_steps, double dt);

}  // namespace cradle
