#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#ifdef YOUBOT_BASE_SIM_PR2_MSGS
#include <pr2_msgs/PowerBoardState.h>
#endif

#include <map>
#include <string>

#include "youbot_base_sim/drive/base_driver.h"
#include "youbot_base_sim/ros/loop_timing.h"
#include "youbot_base_sim/simulation.h"

/// Messages for /diagnostics and the dashboard, as pure functions.
namespace youbot_base_sim {

/// The driver's three statuses, platform_Base, platform_Arm (an error only if `arm_missed`; in the driver without an
/// arm, always) and platform_EtherCAT, to the letter; then the simulator's own, whose names begin with
/// "youbot_base_sim: ": wheels, faults, integration (a warning after fallback steps), loop (timing since the last
/// message; a warning if time was lost), normal reactions and time (a warning with what simulated time `waits_for`,
/// unless that is empty; with the clock's `counters`).
diagnostic_msgs::DiagnosticArray diagnostics_message(const BaseDriver& driver, const Simulation& simulation,
                                                     const LoopTiming::Report& timing, const std::string& waits_for,
                                                     const std::map<std::string, std::string>& counters,
                                                     bool arm_missed, const ros::Time& stamp);

/// The status "youbot_base_sim: bag" of the bag `path`: an error if `failure` says why it cannot be written.
diagnostic_msgs::DiagnosticStatus bag_status(const std::string& path, const std::string& failure);

#ifdef YOUBOT_BASE_SIM_PR2_MSGS
/// The driver's: circuit 0 is the base, circuit 1 the arm that is not there, run_stop a lost EtherCAT.
pr2_msgs::PowerBoardState dashboard_message(const BaseDriver& driver, const ros::Time& stamp);
#endif

}  // namespace youbot_base_sim
