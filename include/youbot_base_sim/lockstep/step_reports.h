#pragma once

#include <ros/node_handle.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "youbot_base_sim/lockstep/time_gate.h"

namespace youbot_base_sim {

/// A gate for nodes that say when they are done with a step: by a message to the source of /clock, such as a command,
/// or by a time on the topic `step_done`, up to which they are done. It looks at no process: nodes may run anywhere.
///
/// It is ready once all `nodes` have reported and then been silent for a while, so no earlier report is under way.
/// After `patience`, s of wall time, a warning names a node that does not report, and the gate gives it up until it
/// does. Reports are callbacks of `node`. `send` publishes /clock. Throws ros::InvalidNameException.
std::unique_ptr<TimeGate> make_step_reports(ros::NodeHandle& node, const std::vector<std::string>& nodes,
                                            std::chrono::duration<double> patience,
                                            const std::function<void(const ros::Time& time)>& send);

}  // namespace youbot_base_sim
