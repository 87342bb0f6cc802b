#pragma once

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/contacts.h"
#include "youbot_base_sim/physics/parameters.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Sources and sinks of power, W.
struct PowerBalance {
  double drive;     ///< what the torques put into the wheels
  double bearings;  ///< what the wheels' bearings take, dry friction of the drives included
  double rollers;   ///< what the rollers' bearings take, dry friction included
  double floor;     ///< what slip and spin on the floor take
  double external;  ///< what gravity on a slope and wrenches put in

  /// The net power, which changes the kinetic energy.
  double net() const { return drive + external - bearings - rollers - floor; }
};

/// The balance in the given state with these contacts under the wheel torques `M` (N m).
PowerBalance power_balance(const RobotParameters& robot, const State& state, const ContactDetails& contacts,
                           const Wheels& M);

}  // namespace youbot_base_sim
