#pragma once

#include <optional>

#include "youbot_base_sim/drive/driver_kinematics.h"
#include "youbot_base_sim/sensors/imu.h"
#include "youbot_base_sim/sensors/motor_sensors.h"
#include "youbot_base_sim/sensors/wheel_odometry.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// The base's own sensors: its motors' readings, the wheel odometry that they make, and on request an inertial unit.
class BaseSensors {
 public:
  struct Options {
    DriverKinematics kinematics;     ///< of the odometry and of `cmd_vel`
    double wheel_error = 0;          ///< for the odometry's covariances, see WheelOdometry
    std::optional<ImuSettings> imu;  ///< empty: none
  };

  /// At the beginning of `scene`, with the odometry at zero. `motor` and `quantized` as MotorSensors'.
  BaseSensors(const Scene& scene, const Options& options, const Motor& motor = {}, bool quantized = false)
      : motors_(motor, quantized, scene.initial.phi()),
        odometry_(options.kinematics, motors_.read(scene.initial.phi(), scene.initial.dphi(), Wheels::Zero()).phi,
                  options.wheel_error, motor) {
    if (options.imu) imu_.emplace(*options.imu, scene.floor, 0, scene.initial);
  }

  /// Those of a run offline: readings are exact unless the scene's motors are `quantized`, and the kinematics the
  /// youBot's unless they are to be the robot's.
  static BaseSensors of(const Scene& scene) {
    const MotorSettings motors = scene.motors.value_or(MotorSettings());
    Options options;
    if (motors.scene_kinematics.value_or(false)) options.kinematics = DriverKinematics::of(scene.robot);
    return {scene, options, Motor(), motors.quantized.value_or(false)};
  }

  /// At time t (s) reads the motors, which exert `torque` (N m), under `faults`; steps odometry and inertial unit.
  void update(double t, const State& state, const Wheels& torque, const Faults& faults = {}) {
    odometry_.update(motors_.read(state.phi(), state.dphi(), torque, faults).phi);
    if (imu_) imu_->update(t, state);
  }

  /// Reads the motors, and has the odometry start again from zero.
  void restart_odometry(const State& state, const Wheels& torque, const Faults& faults) {
    odometry_.reset(motors_.read(state.phi(), state.dphi(), torque, faults).phi);
  }

  /// The base was put from one state to another: neither the odometry nor the inertial unit notices.
  void carry(const State& before, const State& after) {
    odometry_.carry(motors_.carry(before.phi(), after.phi()));
    if (imu_) imu_->carry(before, after);
  }

  const MotorReadings& readings() const { return motors_.readings(); }  ///< the last ones
  const WheelOdometry& odometry() const { return odometry_; }
  const std::optional<Imu>& imu() const { return imu_; }

 private:
  MotorSensors motors_;
  WheelOdometry odometry_;
  std::optional<Imu> imu_;
};

}  // namespace youbot_base_sim
