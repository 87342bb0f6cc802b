#pragma once

#include <stdexcept>
#include <string>

#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/drive/wheel_odometry.h"

namespace youbot_base_sim {

/// What is wrong with a configuration file of the driver, in one line: the file, the key, its value and what is
/// allowed.
class DriverConfigurationError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What the driver knows of the base: its configuration file's part that counts here.
struct DriverConfiguration {
  Motor motor;
  DriverKinematics kinematics;
};

/// Reads NAME.cfg in `folder`, the driver's youbot-base.cfg or one like it: the sections [YouBotKinematic] and
/// [Joint_1] to [Joint_4], whose motors must be alike. Throws DriverConfigurationError.
DriverConfiguration load_driver_configuration(const std::string& folder, const std::string& name);

}  // namespace youbot_base_sim
