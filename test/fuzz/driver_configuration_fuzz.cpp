// The driver's configuration file: each is refused in one line, or describes motors and kinematics whose readings,
// set points and odometry are finite.

#include "../temporary_folder.h"
#include "fuzz.h"
#include "youbot_base_sim/drive/base_driver.h"
#include "youbot_base_sim/scene/driver_configuration.h"
#include "youbot_base_sim/sensors/motor_sensors.h"
#include "youbot_base_sim/sensors/wheel_odometry.h"

using namespace youbot_base_sim;

namespace {

void require_usable(const Motor& motor) {
  const std::vector<double> numbers = {motor.gear_ratio, motor.encoder_ticks, motor.torque_constant, motor.tick(),
                                       motor.rpm(),      motor.milliampere(), motor.max_torque(),    motor.max_rate()};
  require_finite(numbers, "a number of the motor");
  for (const double number : numbers) require(number > 0, fmt::format("the motor's {} is positive", number));
}

// What base_node publishes after wheels at rates of up to 30 rad/s have turned for a while.
void require_finite_readings(const DriverConfiguration& configuration) {
  const Wheels phi(1, -2, 300, 0), dphi(30, -3, 0.1, 1e-9);
  BaseDriver::Settings settings;
  settings.motor = configuration.motor;
  BaseDriver driver(settings);
  const Wheels rates = configuration.kinematics.wheel_rates({0.5, -0.3, 1});
  require_finite(rates, "a wheel's rate");
  driver.command(0, drive_command(DriveMode::kVelocity, rates));
  require_finite(driver.sample(0, dphi), "the torque");
  for (const SetPoint& set_point : driver.set_points()) {
    require(std::isfinite(set_point.value), "the set point is finite");
  }
  WheelOdometry odometry(configuration.kinematics, Wheels::Zero(), 0.05, configuration.motor);
  MotorSensors sensors(configuration.motor, true, Wheels::Zero());
  const MotorReadings& readings = sensors.read(phi, dphi, driver.torque());
  require_finite(readings.phi, "an angle");
  require_finite(readings.dphi, "a rate");
  require_finite(readings.torque, "an effort");
  odometry.update(readings.phi);
  require_finite(odometry.pose(), "the odometry");
  require_finite(odometry.pose_covariance(), "the odometry's covariance");
  require_finite(odometry.velocity_covariance(readings.dphi), "the velocity's covariance");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const TemporaryFolder folder;
  folder.write("base.cfg", {reinterpret_cast<const char*>(data), size});
  DriverConfiguration configuration;
  try {
    configuration = load_driver_configuration(folder.path(""), "base");
  } catch (const SceneError& error) {
    require_one_line(error.what());
    return 0;
  }
  require_usable(configuration.motor);
  require_finite_readings(configuration);
  return 0;
}
