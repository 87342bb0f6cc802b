#include "youbot_base_sim/loop/base_sensors.h"

#include <fmt/format.h>

#include <stdexcept>

namespace youbot_base_sim {

BaseSensors::BaseSensors(const Scene& scene, const MotorReadings& readings, const Options& options)
    : readings_(readings), odometry_(options.kinematics, readings.phi, options.wheel_error) {
  if (options.imu) imu_.emplace(*options.imu, scene.floor, 0, scene.initial);
}

void BaseSensors::require_finite(const Simulation& simulation) const {
  const auto require = [&](const char* topic, const char* what, bool is_finite) {
    if (is_finite) return;
    throw std::runtime_error(fmt::format("{}: the {} is not finite at t = {} s", topic, what, simulation.time()));
  };
  require("ground_truth", "state of the base", simulation.state().values.allFinite());
  require("base/joint_states", "position of a wheel", readings_.phi.allFinite());
  require("base/joint_states", "velocity of a wheel", readings_.dphi.allFinite());
  require("base/joint_states", "effort of a wheel", readings_.torque.allFinite());
  require("odom", "pose", odometry_.pose().allFinite());
  require("odom", "twist", odometry_.kinematics().velocity(readings_.dphi).allFinite());
  if (!odometry_.has_covariance()) return;
  require("odom", "pose's covariance", odometry_.pose_covariance().allFinite());
  require("odom", "twist's covariance", odometry_.velocity_covariance(readings_.dphi).allFinite());
}

}  // namespace youbot_base_sim
