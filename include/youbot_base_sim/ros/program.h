#pragma once

#include <functional>

namespace youbot_base_sim {

/// The common part of all nodes' main functions: initializes ROS under the name `name`, refuses command line arguments
/// that ROS does not know, and runs `body`. SIGINT, SIGTERM and SIGHUP shut ROS down, upon which `body` has to return.
/// Returns the exit status: 0; 2 for a refused argument or a ParameterError, 1 for any other exception, both with a
/// line in the log.
int run_program(int argc, char** argv, const char* name, const std::function<void()>& body);

}  // namespace youbot_base_sim
