#include "youbot_base_sim/physics/power_balance.h"

#include "youbot_base_sim/physics/dry_bearings.h"

namespace youbot_base_sim {

PowerBalance power_balance(const RobotParameters& robot, const State& state, const ContactDetails& contacts,
                           const Wheels& M) {
  const DryBearings dry(robot);
  const Wheels dphi = state.dphi(), dgamma = state.dgamma();
  // Computed from the forces on the velocities: a contact that two rollers share has only mean values of friction and
  // slip, whose product is not the mean power.
  const Wheels friction = contacts.F_X * (state.V_X() - robot.R * dphi - contacts.r_X * dgamma) +
                          contacts.F_Y * (state.V_Y() + contacts.r_Y * dgamma) + contacts.M_Z * state.Omega() +
                          contacts.T_S * dgamma;
  return {sum(M * dphi), sum(dphi * (robot.mu_1 * dphi + dry.wheels.torque(dphi))),
          sum(dgamma * (robot.mu_2 * dgamma + dry.rollers.torque(dgamma))), -sum(friction),
          sum(contacts.external * state.values.col(1))};
}

}  // namespace youbot_base_sim
