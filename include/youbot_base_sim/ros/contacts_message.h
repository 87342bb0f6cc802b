#pragma once

#include <ros/time.h>
#include <youbot_base_sim/ContactsStamped.h>

#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// The present state of the four contacts, and where the power goes.
ContactsStamped contacts_message(const Simulation& simulation, const ros::Time& stamp);

}  // namespace youbot_base_sim
