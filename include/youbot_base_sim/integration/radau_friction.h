#pragma once

#include "youbot_base_sim/integration/slip_system.h"

namespace youbot_base_sim {

// Friction as an unknown of its own beside the velocities: what RadauNewton and RadauPrediction do with it.

/// Friction F(V) - K dV of the contacts `c`, of stiffness K, after the velocities have changed by du; shortened to the
/// largest friction.
template <class Model>
typename Model::Friction corrected_friction(const Model& model, const typename Model::Contacts& c,
                                            const typename Model::Stiffness& K, const Velocities& du) {
  using Features = typename Model::Features;
  const typename Model::Friction now = model.features().friction(c);
  return Features::with_force(now, model.contact_friction().bounded(model.changed(Features::force(now), c, K, du),
                                                                    model.features().limit(now, c)));
}
/// The friction by this correction where the normal reactions have changed by dN (N) too.
template <class Model>
typename Model::Friction corrected_friction(const Model& model, const typename Model::Contacts& c,
                                            const typename Model::Stiffness& K, const Velocities& du,
                                            const Wheels& dN) {
  const auto& friction = model.contact_friction();
  const Wheels N = (c.N + dN).max(0), limit = c.f * N;
  const auto now = friction.force(model.features().slip(c), limit);
  return {friction.bounded(model.changed(now, c, K, du), limit), N};
}

/// F, shortened to the largest friction that the law allows at the contacts `c`.
template <class Model>
typename Model::Friction bounded_friction(const Model& model, const typename Model::Friction& F,
                                          const typename Model::Contacts& c) {
  using Features = typename Model::Features;
  const auto pressed = Features::pressed(F);
  return Features::with_force(
      pressed, model.contact_friction().bounded(Features::force(pressed), model.features().limit(pressed, c)));
}

/// |F - F_c|^2 - (share f N)^2, N^2: positive where the friction F_c of the contacts `c` is further from F than that.
/// Spin friction counts, as it shares the limit.
template <class Model>
Wheels friction_gap(const Model& model, const typename Model::Friction& F, const typename Model::Contacts& c,
                    double share) {
  const auto &now = model.features().force(c), &then = Model::Features::force(F);
  Wheels squares = (now[0] - then[0]).square();
  for (int k = 1; k < Model::Features::kSlipComponents; ++k) squares += (now[k] - then[k]).square();
  return squares - (share * model.features().limit(c)).square();
}

/// Changes dphi and dgamma of wheels on one roller, at the angles phi (rad), so that the slip yields the friction F;
/// where F is below this share of f N, near which the slip depends on it too much. `c` are contacts nearby,
/// for the limit of friction.
template <class Model>
void follow_friction(const SlipSystem<Model>& system, const typename Model::Friction& F,
                     const typename Model::Contacts& c, const Wheels& phi, double share, Velocities& u) {
  if constexpr (Model::kLimited) {
    const Model& model = system.model();
    if (model.wheels_prescribed()) return;
    const ContactModes& modes = system.modes();
    const ContactGeometry g = modes.mixed() ? modes.geometry(phi) : model.geometry().at(phi - modes.center());
    const auto& force = Model::Features::force(F);
    const Wheels limit = model.features().limit(F, c);
    const WheelMask gripping = !modes.shared() && model.contact_friction().grips(force, limit, share);
    const auto V = model.contact_friction().slip(force, limit);
    // (3.3) for dgamma and dphi
    const Wheels dgamma = (V[1] - u.v[1] - model.rho_X() * u.v[2]) / g.r_Y;
    const Wheels dphi = (u.v[0] - (model.rho_Y() + g.Delta_Y) * u.v[2] - g.r_X * dgamma - V[0]) * (1 / model.robot().R);
    u.dgamma = gripping.select(dgamma, u.dgamma);
    u.dphi = gripping.select(dphi, u.dphi);
  }
}

}  // namespace youbot_base_sim
