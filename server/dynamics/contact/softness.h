/// How softly a contact gives: the spring and damper that a sub-step of the soft step stands for.
///
/// Symbols: h sub-step, s; omega = 2 pi c / h_c, with c the contact frequency by sub-step; zeta the
/// damping ratio; h_c the sub-step, s, that contacts are as stiff as: h, or shorter.
///   a1 = 2 zeta + h omega, a2 = h omega a1
///   mass scale ms = a2 / (1 + a2), impulse scale is = 1 / (1 + a2), bias rate br = omega / a1
/// Source: Catto (2024), "Solver2D".
#pragma once

namespace cradle {

struct Softness {
  double mass_scale, impulse_scale;
  double bias_rate;  ///< 1/s
};

Softness softness_of(double h, double h_c);

/// 2 pi c: a contact without preload under a load that gives its effective mass the acceleration a
/// sinks in by a (h_c / contact_angle())^2.
double contact_angle();
/// s^2: by so much of that, as stiff as with so many sub-steps in a tick.
double give_of(int stiff_as, double dt);

}  // namespace cradle
