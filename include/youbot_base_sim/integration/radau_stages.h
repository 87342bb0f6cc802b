#pragma once

#include <array>

#include "youbot_base_sim/integration/radau_tableau.h"
#include "youbot_base_sim/physics/contact_modes.h"
#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Velocities u_j at the three stages, m/s and rad/s.
using StageVelocities = std::array<Velocities, RadauTableau::stages>;

/// The unknowns of a step: velocities u_j and friction F_j (N) at each stage.
template <class Model>
struct RadauStages {
  StageVelocities u;
  std::array<typename Model::Friction, RadauTableau::stages> F;
};

/// The start of a step, and what holds for all steps from it.
template <class Model>
struct RadauStart {
  double t = 0;  ///< s
  State x;
  Velocities u;       ///< x's velocities; massless rollers at those of their balance
  Velocities forces;  ///< N and N m
  typename Model::Friction friction;
  Pose pose;               ///< x's, if the model depends on it; else the origin
  Velocities error_scale;  ///< errors that count as 1, m/s and rad/s
  ContactModes::Ids contact_ids = ContactModes::Ids::Zero();
  bool after_switch = false;      ///< the step before ended on another contact
  bool carries_friction = false;  ///< after a switch, the friction before it is a first guess

  /// Wheel angles at stage j of a step of length dt with these velocities, rad.
  Wheels phi_at(int j, double dt, const StageVelocities& stages) const {
    const auto& a = RadauTableau::A[j];
    return x.phi() + dt * (a[0] * stages[0].dphi + a[1] * stages[1].dphi + a[2] * stages[2].dphi);
  }
};

/// Lagrange's weights at s (in steps) on the nodes 0, c_1, c_2, 1, or on the last `nodes` of them.
inline std::array<double, 4> lagrange_weights(double s, int nodes = 4) {
  constexpr double c_1 = RadauTableau::c[0], c_2 = RadauTableau::c[1], k_0 = -1 / (c_1 * c_2),
                   k_1 = 1 / (c_1 * (c_1 - c_2) * (c_1 - 1)), k_2 = 1 / (c_2 * (c_2 - c_1) * (c_2 - 1)),
                   k_3 = 1 / ((1 - c_1) * (1 - c_2));
  const double a = s - c_1, b = s - c_2, c = s - 1;
  if (nodes == 2) return {0, 0, c / (c_2 - 1), b / (1 - c_2)};
  if (nodes == 3) return {0, k_1 * c_1 * b * c, k_2 * c_2 * a * c, k_3 * a * b};
  return {k_0 * a * b * c, k_1 * s * b * c, k_2 * s * a * c, k_3 * s * a * b};
}

/// The polynomial with these values at the nodes.
template <class Value>
Value weighted(const std::array<double, 4>& w, const Value& start, const std::array<Value, 3>& stages) {
  return w[0] * start + w[1] * stages[0] + w[2] * stages[1] + w[3] * stages[2];
}

}  // namespace youbot_base_sim
