#pragma once

#include <optional>

#include "youbot_base_sim/drive/imu.h"
#include "youbot_base_sim/drive/motor_sensors.h"
#include "youbot_base_sim/drive/wheel_odometry.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// What the base knows of itself: its motors' readings, the wheel odometry that they make, and on request an inertial
/// unit.
class BaseSensors {
 public:
  struct Options {
    DriverKinematics kinematics;     ///< of the odometry and of `cmd_vel`
    double wheel_error = 0;          ///< for the odometry's covariances, see WheelOdometry
    std::optional<ImuSettings> imu;  ///< empty: none
  };

  /// At the beginning of `scene`, with the odometry at zero. `motor` is what the readings come from.
  BaseSensors(const Scene& scene, const MotorReadings& readings, const Options& options, const Motor& motor = {})
      : readings_(readings), odometry_(options.kinematics, readings.phi, options.wheel_error, motor) {
    if (options.imu) imu_.emplace(*options.imu, scene.floor, 0, scene.initial);
  }

  /// At time t (s): the odometry makes one step to the angles of `readings`, and the inertial unit reads `state`.
  void update(double t, const State& state, const MotorReadings& readings) {
    readings_ = readings;
    odometry_.update(readings.phi);
    if (imu_) imu_->update(t, state);
  }

  /// Has the odometry start again from zero.
  void restart_odometry(const MotorReadings& readings) {
    readings_ = readings;
    odometry_.reset(readings.phi);
  }

  /// The base was put from one state to another, by which the motors' readings of the wheel angles changed by `change`,
  /// rad: neither the odometry nor the inertial unit notices.
  void carry(const State& before, const State& after, const Wheels& change) {
    readings_.phi += change;
    odometry_.carry(change);
    if (imu_) imu_->carry(before, after);
  }

  const MotorReadings& readings() const { return readings_; }  ///< of the last update or restart
  const WheelOdometry& odometry() const { return odometry_; }
  const std::optional<Imu>& imu() const { return imu_; }

 private:
  MotorReadings readings_;
  WheelOdometry odometry_;
  std::optional<Imu> imu_;
};

}  // namespace youbot_base_sim
