#include "youbot_base_sim/ros/base_settings.h"

#include <fmt/format.h>
#include <ros/ros.h>

#include <algorithm>
#include <cmath>
#include <regex>

#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/scene/driver_configuration.h"

namespace youbot_base_sim {

namespace {

constexpr double kMinPublishRate = 1e-3;  // Hz
constexpr double kMinCommandRate = 0.1;   // Hz; commands wait for so long

constexpr double kLockstepPeriod = 0.01;  // s, or the control period if that is longer

constexpr Range kPeriods{kControlPeriods.min, kControlPeriods.max, kControlPeriods.unit};  // never continuous in time

/// The scene's settings among the parameters.
SceneSettings read_scene_settings(Parameters& parameters) {
  SceneSettings settings;
  const auto read = [&](const char* name, const char* key, auto value, const auto&... range) {
    if (parameters.read(name, value, range...)) settings.emplace_back(key, *value);
  };
  std::string model = "the scene's", method = model;
  if (parameters.read_choice("model", model, model_names())) settings.emplace_back("model", model, true);
  if (parameters.read_choice("method", method, method_names())) settings.emplace_back("solver.method", method, true);
  read("control_period", "solver.control_period", std::optional<double>(), kPeriods);
  read("relative_tolerance", "solver.relative_tolerance", std::optional<double>(), kRelativeTolerances);
  read("dry_friction", "robot.dry_friction", std::optional<double>(), Range{0, 100, "N m"});
  read("initial_pose", "initial.pose", std::optional<Eigen::Array3d>(), kPoses);
  read("initial_wheel_angles", "initial.wheel_angles", std::optional<Wheels>(), kWheelAngles);
  return settings;
}

/// Control periods a second, and a little more for rounding.
double max_rate(const BaseSettings& settings) { return (1 + 1e-9) / settings.scene.solver.control_period; }

Range rates(double min, const BaseSettings& settings, bool or_zero = false) {
  return {min, max_rate(settings), "Hz: at most once a control period", or_zero};
}

void read_driver_parameters(Parameters& parameters, BaseSettings& settings) {
  bool has_base = true;
  parameters.read("youBotHasBase", has_base);
  parameters.require(has_base, "youBotHasBase", "false", "true: this node simulates the base and nothing else");
  parameters.read("youBotHasArms", settings.has_arms);
  if (settings.has_arms) ROS_WARN("youBotHasArms is true, but no arm is simulated: it will not be found");
  settings.publish_rate = std::min(settings.publish_rate, max_rate(settings));
  parameters.read("youBotDriverCycleFrequencyInHz", settings.publish_rate, rates(kMinPublishRate, settings));
  settings.command_rate = settings.publish_rate;  // one loop in the driver
  std::string folder, name = "youbot-base";
  parameters.read("youBotConfigurationFilePath", folder, "a folder");
  parameters.read("youBotBaseName", name, "the name of a .cfg file in it");
  if (folder.empty()) return;
  try {
    const DriverConfiguration configuration = load_driver_configuration(folder, name);
    settings.driver.motor = configuration.motor;
    settings.sensors.kinematics = configuration.kinematics;
  } catch (const SceneError& error) {
    throw ParameterError(fmt::format("parameter youBotConfigurationFilePath: {}", error.what()));
  }
}

void read_lockstep(Parameters& parameters, BaseSettings& settings) {
  LockstepSettings& lockstep = settings.lockstep;
  const double control_period = settings.scene.solver.control_period;
  parameters.read("lockstep", lockstep.on);
  lockstep.period = control_period * std::max(1.0, std::round(kLockstepPeriod / control_period));
  const bool given = parameters.read("lockstep_period", lockstep.period, {control_period, 10, "s", true});
  parameters.read("lockstep_timeout", lockstep.timeout, {1e-3, 1e6, "s", true});
  parameters.read("lockstep_strict", lockstep.strict);
  parameters.read("end_with_commands", lockstep.end_with_commands);
  const bool waits = parameters.read("wait_for", lockstep.wait_for);
  const std::string period = fmt::format("{:g}", lockstep.period);
  const double periods = lockstep.period / control_period;
  parameters.require(std::abs(periods - std::round(periods)) <= 1e-6, "lockstep_period", period,
                     fmt::format("a multiple of the control period, {:g} s", control_period));
  parameters.require(lockstep.timeout > 0 || lockstep.period == 0 || !lockstep.on, "lockstep_timeout", "0",
                     "above 0 unless ~lockstep_period is 0: time would wait for ever for a node that does not rest");
  parameters.require(lockstep.on || !lockstep.end_with_commands, "end_with_commands", "true",
                     "false unless ~lockstep is true");
  parameters.require((lockstep.on && lockstep.period > 0) || !waits, "wait_for", "a list",
                     "unset unless ~lockstep is true");
  parameters.require(lockstep.on || !given || lockstep.period == 0, "lockstep_period", period,
                     "0 unless ~lockstep is true");
  if (!lockstep.on) lockstep.period = 0;
}

void read_motors(Parameters& parameters, BaseSettings& settings) {
  MotorSettings& motors = settings.driver.motors;
  motors = settings.scene.motors.value_or(MotorSettings());
  visit_settings(motors, [&parameters](const char* name, auto& value, const auto&... range) {
    parameters.read(name, value, range...);
  });
  if (motors.scene_kinematics.value_or(false)) settings.sensors.kinematics = DriverKinematics::of(settings.scene.robot);
  const std::string limit = stable_period(settings.scene, motors.gains);
  parameters.require(limit.empty(), "control_period", fmt::format("{:g}", settings.scene.solver.control_period), limit);
}

void read_sensors(Parameters& parameters, BaseSensors::Options& sensors) {
  parameters.read("driver_wheel_radius", sensors.kinematics.wheel_radius, {1e-3, 1, "m"});
  parameters.read("odometry_wheel_error", sensors.wheel_error, {0, 1, ""});
  bool publish = false;
  ImuSettings imu;
  parameters.read("publish_imu", publish);
  const auto read_errors = [&](const std::string& name, SensorErrors& errors, double max, const std::string& unit) {
    const std::string density = unit + "/sqrt(Hz)", walk = unit + "/sqrt(s)";
    parameters.read(name + "_noise", errors.noise, {0, max, unit.c_str()});
    parameters.read(name + "_noise_density", errors.density, {0, max, density.c_str()});
    parameters.read(name + "_bias", errors.bias, {0, max, unit.c_str()});
    parameters.read(name + "_bias_walk", errors.walk, {0, max, walk.c_str()});
  };
  read_errors("imu_rate", imu.rate, 10, "rad/s");
  read_errors("imu_acceleration", imu.acceleration, 100, "m/s^2");
  parameters.read("imu_position", imu.position.array(), kLoadPositions);
  if (publish) sensors.imu = imu;
}

constexpr char kFrames[] = "a frame of at most 200 letters, digits, _ - . and slashes between them";

/// tf_prefix is searched for upwards from the node's own namespace, as robot_state_publisher does.
FrameNames read_frames(Parameters& parameters) {
  std::string prefix, odom = kOdometryFrame, base = kBaseFrame, world = kWorldFrame;
  const auto read = [&parameters](const char* name, std::string& frame, bool is_prefix = false) {
    static const std::regex allowed("/?[[:alnum:]_.-]+(/[[:alnum:]_.-]+)*");
    const bool given = parameters.read(name, frame, kFrames) || (is_prefix && parameters.search(name, frame, kFrames));
    const bool holds = (is_prefix && frame.empty()) || (frame.size() <= 200 && std::regex_match(frame, allowed));
    parameters.require(holds || !given, name, '"' + frame + '"', kFrames);
  };
  read("tf_prefix", prefix, true);
  read("odom_frame", odom);
  read("base_frame", base);
  read("world_frame", world);
  FrameNames frames = FrameNames::of(prefix, odom, base, world);
  read("map_frame", frames.map);
  parameters.require(frames.odom != frames.base && frames.odom != frames.world, "odom_frame", '"' + odom + '"',
                     "another than those of the base and of the world: TF would have a loop");
  parameters.require(frames.base != frames.world, "base_frame", '"' + base + '"', "another than that of the world");
  return frames;
}

void read_telemetry(Parameters& parameters, BaseSettings& settings) {
  Telemetry::Options& telemetry = settings.telemetry;
  telemetry.contacts = settings.scene.contacts_in_bags;
  std::string sign = "driver_exact";
  parameters.read("publish_tf", settings.publish_tf);
  parameters.read("listen_to_initialpose", settings.listen_to_initialpose);
  parameters.read("world_tf", telemetry.world);
  parameters.read("publish_casters", telemetry.casters);
  parameters.read("publish_rollers", telemetry.rollers);
  parameters.read("publish_contacts", telemetry.contacts);
  parameters.read_choice("joint_velocity_sign", sign, {"consistent", "driver_exact"});
  telemetry.driver_velocity_sign = sign == "driver_exact";
  telemetry.frames = read_frames(parameters);
  telemetry.markers = marker_options(settings.scene.robot, telemetry.world, telemetry.frames);
  parameters.read("friction_marker_scale", telemetry.markers.friction_scale, {1e-9, 1e3, "m/N"});
  parameters.read("slip_marker_scale", telemetry.markers.slip_scale, {1e-6, 1e6, "s"});
}

/// Refuses settings that only the master of time may have.
void check_time(const Parameters& parameters, const BaseSettings& settings) {
  if (settings.publish_clock) {
    if (ros::param::param("/use_sim_time", false)) return;
    ROS_WARN("/use_sim_time is not set: nodes that start now will not follow the clock of this one");
    return;
  }
  parameters.require(settings.real_time_factor == 1, "real_time_factor", fmt::format("{:g}", settings.real_time_factor),
                     "1 unless ~publish_clock is true: another clock has its own rate");
  parameters.require(!settings.lockstep.on, "lockstep", "true", "false unless ~publish_clock is true");
  parameters.require(!settings.start_paused, "start_paused", "true", "false unless ~publish_clock is true");
}

}  // namespace

BaseSettings read_base_settings(Parameters parameters, Parameters driver_parameters) {
  BaseSettings settings;
  settings.scene = read_scene(parameters, read_scene_settings(parameters));
  read_driver_parameters(driver_parameters, settings);
  parameters.read("publish_rate", settings.publish_rate, rates(kMinPublishRate, settings));
  parameters.read("command_rate", settings.command_rate, rates(kMinCommandRate, settings, true));
  parameters.read("publish_clock", settings.publish_clock);
  parameters.read("real_time_factor", settings.real_time_factor, {1e-3, 1e6, "", true});
  read_lockstep(parameters, settings);
  settings.scene.solver.keeps_up = !settings.lockstep.on;  // lockstep waits, and has the bits of `simulate`
  if (settings.lockstep.on) settings.command_rate = 0;     // each control period takes what has come
  parameters.read("wait_for_subscribers", settings.wait_for_subscribers);
  parameters.read("start_paused", settings.start_paused);
  parameters.read("end_time", settings.end_time, {0, 1e6, "s"});
  read_motors(parameters, settings);
  parameters.read("command_timeout", settings.driver.command_timeout, {0, 1e6, "s"});
  read_sensors(parameters, settings.sensors);
  read_telemetry(parameters, settings);
  parameters.read("bag", settings.bag, "a file");
  parameters.read("bag_required", settings.bag_required);
  parameters.refuse_others();
  check_time(parameters, settings);
  return settings;
}

}  // namespace youbot_base_sim
