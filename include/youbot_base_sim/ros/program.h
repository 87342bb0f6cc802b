#pragma once

#include <functional>

namespace youbot_base_sim {

/// What the main functions of nodes have in common: starts ROS under the name `name`, refuses arguments of the command
/// line that ROS does not know, and runs `body`. Returns the exit status: 0; 2 for a refused argument or a
/// ParameterError, 1 for any other exception, both with a line in the log.
int run_program(int argc, char** argv, const char* name, const std::function<void()>& body);

}  // namespace youbot_base_sim
