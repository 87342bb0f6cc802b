#pragma once

#include <string>

#include "youbot_base_sim/drive/base_driver.h"
#include "youbot_base_sim/drive/wheel_odometry.h"
#include "youbot_base_sim/ros/node_constants.h"
#include "youbot_base_sim/ros/telemetry.h"
#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

/// What base_node is told by parameters: its private ones, by their names, and those of the real driver, which are
/// relative to the node's namespace:
///
///   youBotHasBase                  must be true: there is nothing else
///   youBotHasArms                  may be true, as in the driver's launch file: no arm is found then
///   youBotDriverCycleFrequencyInHz rate of publishing if `publish_rate` is left out, Hz
///   youBotConfigurationFilePath    folder of a file youBotBaseName.cfg with the base's motors and kinematics
///   youBotBaseName                 "youbot-base" if left out
///
/// The driver's others (names of arms, the trajectory action's) are for arms.
struct BaseSettings {
  /// `scene`: a scene file, of which robot, floor, initial state, model and solver count and the drive does not. Left
  /// out: the paper's robot at rest at the origin, integrated to a relative tolerance of 1e-5. `model`,
  /// `relative_tolerance`: in place of the scene's. `control_period` (s): likewise; 1 ms if neither says.
  Scene scene;
  /// Instants of publishing a second, Hz; the driver's rate by default. Also the rate at which odometry is
  /// integrated.
  double publish_rate = kDefaultPublishRate;
  /// Instants a second at which commands and services are looked for, Hz; 0: they count from the control period on in
  /// which they come. The driver looks 50 times a second.
  double command_rate = 0;
  /// Whether the node is the master of simulated time: publishes /clock, stamps with simulated time, and has the
  /// services. Needs /use_sim_time for everybody else to follow. Otherwise stamps are wall time.
  bool publish_clock = false;
  /// Simulated seconds a second; 0: as fast as it can. Other than 1 only with `publish_clock`.
  double real_time_factor = 1;
  /// Each control period waits for one command message: a player that answers each /clock message with a command is
  /// thereby obeyed in every period, however slow it is. Only with `publish_clock`.
  bool lockstep = false;
  /// Time starts when each published topic of `Telemetry` has a subscriber, so that a recorder misses nothing.
  bool wait_for_subscribers = false;
  /// File to record to, a `BagWriter`'s; it appears when the node ends. Left out: none. Only with `publish_clock`.
  std::string bag;
  /// Starts as after ~pause. Only with `publish_clock`.
  bool start_paused = false;
  /// Whether odom to base_footprint goes to /tf.
  bool publish_tf = true;
  /// Whether world to odom goes to /tf_static, at the scene's initial pose, so that odometry and ground truth
  /// overlay.
  bool world_tf = false;
  /// The driver's and the motors': `quantized`, `dry_friction` (N m), `command_timeout` (s),
  /// `velocity_proportional_gain` (N m s/rad), `velocity_integral_gain` (N m/rad).
  BaseDriver::Settings driver;
  /// `publish_rollers`; `joint_velocity_sign`: consistent (with positions), or driver_exact: the driver's, of which
  /// those on the left are the opposite; `odometry_wheel_error`, for covariances; `driver_wheel_radius` (m), for `odom`
  /// and `cmd_vel`.
  Telemetry::Options telemetry;
  /// Whether a stack was promised arms: diagnostics tell that there are none in any case.
  bool has_arms = false;
};

/// Reads and checks the parameters. Throws ParameterError.
BaseSettings read_base_settings();

}  // namespace youbot_base_sim
