#pragma once

#include <youbot_base_sim/drive/base_driver.h>
#include <youbot_base_sim/sensors/motor_sensors.h>
#include <youbot_base_sim/simulation.h>

#include <array>

namespace youbot_robot_hw {

/// One set point for each wheel, in the order of the driver's joints: fl, fr, bl, br.
using SetPoints = std::array<youbot_base_sim::SetPoint, youbot_base_sim::kWheels>;

/// The simulated base behind its driver, without ROS: motors that take a rate or a torque each, and their readings.
class TestBed {
 public:
  /// The base of a scene with a control period, whose drive is ignored. Throws std::invalid_argument without a period.
  explicit TestBed(const youbot_base_sim::Scene& scene);
  TestBed(const TestBed&) = delete;
  TestBed& operator=(const TestBed&) = delete;

  /// Angles (rad), rates (rad/s) and torques (N m) as encoders and current sensors tell them; all positive forward.
  const youbot_base_sim::MotorReadings& read() {
    return sensors_.read(state().phi(), state().dphi(), driver_.torque());
  }

  /// New set points from the present control period on. False if one is not finite: that wheel keeps its last.
  bool command(const SetPoints& set_points);

  /// Advances by a duration, s. Throws std::invalid_argument unless that is a whole number of control periods, from one
  /// on.
  void advance(double duration);

  double time() const { return simulation_.time(); }                           ///< s
  const youbot_base_sim::State& state() const { return simulation_.state(); }  ///< where the base really is
  const youbot_base_sim::Scene& scene() const { return simulation_.scene(); }

 private:
  youbot_base_sim::BaseDriver driver_;
  youbot_base_sim::MotorSensors sensors_;
  youbot_base_sim::Simulation simulation_;
};

}  // namespace youbot_robot_hw
