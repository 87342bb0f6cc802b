#include "youbot_base_sim/ros/base_settings.h"

#include <fmt/format.h>
#include <ros/ros.h>

#include <cmath>

#include "youbot_base_sim/drive/driver_configuration.h"
#include "youbot_base_sim/ros/parameters.h"

namespace youbot_base_sim {

namespace {

// Default tolerance without a scene: a minute of driving ends within a few micrometres, at a third of the run time that
// the scenes' default takes.
constexpr double kTolerance = 1e-5;

constexpr double kMinPublishRate = 1e-3;  // Hz
constexpr double kMinCommandRate = 0.1;   // Hz; commands wait for so long

constexpr Range kPeriods{kControlPeriods.min, kControlPeriods.max, kControlPeriods.unit};  // never continuous in time

SceneOverrides read_overrides(Parameters& parameters) {
  SceneOverrides overrides;
  overrides.model = parameters.text("model", "");
  overrides.method = parameters.text("method", "");
  overrides.control_period = parameters.number("control_period", overrides.control_period, kPeriods);
  overrides.relative_tolerance =
      parameters.number("relative_tolerance", overrides.relative_tolerance, kRelativeTolerances);
  overrides.profile = parameters.text("profile", "");
  overrides.friction_scale = parameters.number("friction_scale", overrides.friction_scale, kFrictionScales);
  return overrides;
}

Scene read_scene(Parameters& parameters) {
  const std::string path = parameters.text("scene", "");
  SceneOverrides overrides = read_overrides(parameters);
  if (path.empty() && !overrides.relative_tolerance) overrides.relative_tolerance = kTolerance;
  Scene scene;
  try {
    scene = default_scene(overrides);
  } catch (const SceneError& error) {
    throw ParameterError(fmt::format("parameter ~{}", error.what()));  // "model = ..."
  }
  try {
    if (!path.empty()) scene = load_scene(path, overrides);
  } catch (const SceneError& error) {
    throw ParameterError(fmt::format("parameter ~scene: {}", error.what()));
  }
  if (scene.solver.control_period == 0) scene.solver.control_period = 1e-3;
  scene.drive = std::monostate();
  const auto friction = parameters.number("dry_friction", std::optional<double>(), {0, 100, "N m"});
  if (friction) scene.robot.dry_friction.setConstant(*friction);
  return scene;
}

/// Control periods a second, which no other rate may exceed; and a little more, for rounding.
double max_rate(const BaseSettings& settings) { return (1 + 1e-9) / settings.scene.solver.control_period; }

Range rates(double min, const BaseSettings& settings) {
  return {min, max_rate(settings), "Hz: at most once a control period"};
}

/// Reads the real driver's parameters.
void read_driver_parameters(BaseSettings& settings) {
  Parameters parameters(ros::NodeHandle(), "");
  if (!parameters.flag("youBotHasBase", true)) {
    throw parameters.refusal("youBotHasBase", "false", "true: this node simulates the base and nothing else");
  }
  settings.has_arms = parameters.flag("youBotHasArms", false);
  settings.publish_rate =
      parameters.number("youBotDriverCycleFrequencyInHz", std::min(settings.publish_rate, max_rate(settings)),
                        rates(kMinPublishRate, settings));
  const std::string folder = parameters.text("youBotConfigurationFilePath", "");
  const std::string name = parameters.text("youBotBaseName", "youbot-base");
  if (folder.empty()) return;
  try {
    const DriverConfiguration configuration = load_driver_configuration(folder, name);
    settings.driver.motor = configuration.motor;
    settings.sensors.kinematics = configuration.kinematics;
  } catch (const DriverConfigurationError& error) {
    throw ParameterError(fmt::format("parameter youBotConfigurationFilePath: {}", error.what()));
  }
}

void read_rates(Parameters& parameters, BaseSettings& settings) {
  settings.publish_rate = parameters.number("publish_rate", settings.publish_rate, rates(kMinPublishRate, settings));
  Range command_rates = rates(kMinCommandRate, settings);
  command_rates.or_zero = true;
  settings.command_rate = parameters.number("command_rate", settings.command_rate, command_rates);
}

void read_lockstep(Parameters& parameters, BaseSettings& settings) {
  LockstepSettings& lockstep = settings.lockstep;
  const double control_period = settings.scene.solver.control_period;
  lockstep.on = parameters.flag("lockstep", lockstep.on);
  lockstep.period = parameters.number("lockstep_period", lockstep.period, {control_period, 10, "s", true});
  lockstep.timeout = parameters.number("lockstep_timeout", lockstep.timeout, {1e-3, 1e6, "s", true});
  lockstep.end_with_commands = parameters.flag("end_with_commands", lockstep.end_with_commands);
  const double periods = lockstep.period / control_period;
  if (std::abs(periods - std::round(periods)) > 1e-6) {
    throw parameters.refusal("lockstep_period", fmt::format("{:g}", lockstep.period),
                             fmt::format("a multiple of the control period, {:g} s", control_period));
  }
  if (lockstep.timeout > 0 && lockstep.period == 0 && !lockstep.end_with_commands) {
    throw parameters.refusal("lockstep_timeout", fmt::format("{:g}", lockstep.timeout),
                             "0 unless ~lockstep_period or ~end_with_commands is set: a player of each control period "
                             "may take its time");
  }
  if (lockstep.end_with_commands && !lockstep.on) {
    throw parameters.refusal("end_with_commands", "true", "false unless ~lockstep is true");
  }
  if (lockstep.period > 0 && !lockstep.on) {
    throw parameters.refusal("lockstep_period", fmt::format("{:g}", lockstep.period), "0 unless ~lockstep is true");
  }
}

void read_time(Parameters& parameters, BaseSettings& settings) {
  settings.publish_clock = parameters.flag("publish_clock", settings.publish_clock);
  settings.real_time_factor = parameters.number("real_time_factor", settings.real_time_factor, {1e-3, 1e6, "", true});
  read_lockstep(parameters, settings);
  settings.wait_for_subscribers = parameters.flag("wait_for_subscribers", settings.wait_for_subscribers);
  settings.start_paused = parameters.flag("start_paused", settings.start_paused);
}

/// Reads each motor setting that is set, in place of the scene's.
struct MotorReader {
  Parameters& parameters;

  template <class Number>  // double or std::optional<double>
  void operator()(const char* name, Number& number, const Range& range) const {
    number = parameters.number(name, number, range);
  }
  void operator()(const char* name, std::optional<bool>& flag) const { flag = parameters.flag(name, flag); }
};

void read_drive(Parameters& parameters, BaseSettings& settings) {
  BaseDriver::Settings& driver = settings.driver;
  driver.motors = settings.scene.motors.value_or(MotorSettings());
  visit_settings(driver.motors, MotorReader{parameters});
  driver.command_timeout = parameters.number("command_timeout", driver.command_timeout, {0, 1e6, "s"});
}

void read_sensors(Parameters& parameters, BaseSensors::Options& sensors) {
  sensors.kinematics.wheel_radius =
      parameters.number("driver_wheel_radius", sensors.kinematics.wheel_radius, {1e-3, 1, "m"});
  sensors.wheel_error = parameters.number("odometry_wheel_error", sensors.wheel_error, {0, 1, ""});
  const bool publish = parameters.flag("publish_imu", false);
  ImuSettings imu;
  imu.rate_noise = parameters.number("imu_rate_noise", imu.rate_noise, {0, 10, "rad/s"});
  imu.rate_bias = parameters.number("imu_rate_bias", imu.rate_bias, {0, 10, "rad/s"});
  imu.acceleration_noise = parameters.number("imu_acceleration_noise", imu.acceleration_noise, {0, 100, "m/s^2"});
  imu.acceleration_bias = parameters.number("imu_acceleration_bias", imu.acceleration_bias, {0, 100, "m/s^2"});
  if (publish) sensors.imu = imu;
}

void read_telemetry(Parameters& parameters, BaseSettings& settings) {
  Telemetry::Options& telemetry = settings.telemetry;
  settings.publish_tf = parameters.flag("publish_tf", settings.publish_tf);
  telemetry.world = parameters.flag("world_tf", telemetry.world);
  telemetry.rollers = parameters.flag("publish_rollers", telemetry.rollers);
  telemetry.contacts = parameters.flag("publish_contacts", settings.scene.output.contacts);
  const std::string sign = parameters.text("joint_velocity_sign", "consistent");
  if (sign != "consistent" && sign != "driver_exact") {
    throw parameters.refusal("joint_velocity_sign", "\"" + sign + "\"", "consistent or driver_exact");
  }
  telemetry.driver_velocity_sign = sign == "driver_exact";
}

void read_markers(Parameters& parameters, BaseSettings& settings) {
  MarkerOptions& markers = settings.markers;
  markers = marker_options(settings.scene.robot, settings.telemetry.world);
  markers.friction_scale = parameters.number("friction_marker_scale", markers.friction_scale, {1e-9, 1e3, "m/N"});
  markers.slip_scale = parameters.number("slip_marker_scale", markers.slip_scale, {1e-6, 1e6, "s"});
}

/// Refuses settings that only make sense where the node is the master of time.
void check_time(const Parameters& parameters, const BaseSettings& settings) {
  bool use_sim_time = false;
  ros::param::get("/use_sim_time", use_sim_time);
  if (settings.publish_clock) {
    if (!use_sim_time) ROS_WARN("/use_sim_time is not set: nodes that start now will not follow the clock of this one");
    return;
  }
  if (use_sim_time) {
    throw ParameterError(
        "parameter ~publish_clock = false: must be true where /use_sim_time is true, or no node has the time");
  }
  if (settings.real_time_factor != 1) {
    throw parameters.refusal("real_time_factor", fmt::format("{:g}", settings.real_time_factor),
                             "1 unless ~publish_clock is true: the wall clock has its own rate");
  }
  if (settings.lockstep.on) throw parameters.refusal("lockstep", "true", "false unless ~publish_clock is true");
  if (!settings.bag.empty()) {
    throw parameters.refusal("bag", settings.bag, "left out unless ~publish_clock is true: use rosbag record");
  }
  if (settings.start_paused) throw parameters.refusal("start_paused", "true", "false unless ~publish_clock is true");
}

}  // namespace

BaseSettings read_base_settings() {
  Parameters parameters(ros::NodeHandle("~"), "~");
  BaseSettings settings;
  settings.scene = read_scene(parameters);
  read_driver_parameters(settings);
  read_rates(parameters, settings);
  read_time(parameters, settings);
  read_drive(parameters, settings);
  read_sensors(parameters, settings.sensors);
  read_telemetry(parameters, settings);
  read_markers(parameters, settings);
  settings.bag = parameters.text("bag", settings.bag);
  settings.bag_required = parameters.flag("bag_required", settings.bag_required);
  parameters.refuse_others();
  check_time(parameters, settings);
  return settings;
}

}  // namespace youbot_base_sim
