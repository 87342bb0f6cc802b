#pragma once

#include <string>

#include "youbot_base_sim/loop/base_loop.h"
#include "youbot_base_sim/ros/telemetry.h"

namespace youbot_base_sim {

/// The parameters of base_node: its private ones, named as the members here, and those of the real driver, which are
/// relative to the node's namespace:
///
///   youBotHasBase                  must be true: the node simulates nothing else
///   youBotHasArms                  may be true, as in the driver's launch file; no arm is found then
///   youBotDriverCycleFrequencyInHz publish rate if `publish_rate` is left out, Hz
///   youBotConfigurationFilePath    folder of the file youBotBaseName.cfg with the base's motors and kinematics
///   youBotBaseName                 "youbot-base" by default
///
/// The driver's other parameters (names of arms, trajectory action) concern arms and are ignored.
///
/// Of LoopSettings: `scene` comes from the parameters `scene` (a scene file; its `drive` section is ignored), `model`,
/// `method`, `profile`, `friction_scale`, `relative_tolerance`, `control_period` (s) and `dry_friction` (N m, of each
/// wheel's drive); each overrides the scene's value. Without a scene file: the paper's robot with the
/// measured profile, at rest at the origin, a relative tolerance of 1e-5 and a control period of 1 ms. `publish_rate`
/// and `command_rate`, both the driver's cycle frequency if left out, are at most once a control period. `driver` has
/// `command_timeout` (s) and, in place of the scene's section `motors`, what MotorSettings has; `sensors`,
/// `driver_wheel_radius` (m), `odometry_wheel_error` and, with `publish_imu`, the errors of the inertial unit.
///
/// `lockstep`: each period waits for a command message. Messages that come while time stands still, paused or because
/// the period is not due yet, count as one. Needs `publish_clock`. Without a `lockstep_period` (s) that is each control
/// period, so that a player that answers each /clock message with a command acts in every one, however slow it is.
/// With it, /clock advances by whole periods, once the nodes that follow it have dealt with all else that was
/// published; so a node with a loop of this period always commands from the latest odometry, and for the same period.
/// After `lockstep_timeout` (s of wall time, 0: none) time advances without a command. Until the first command only
/// /clock does: the simulation begins with it.
struct BaseSettings : LoopSettings {
  /// Makes the node the master of simulated time: it publishes /clock, stamps messages with simulated time and offers
  /// the time services. Other nodes follow only if /use_sim_time is true. Otherwise stamps are wall time.
  bool publish_clock = false;
  /// Simulated seconds per second, 0.001 or more; 0: as fast as possible. Other values than 1 need `publish_clock`.
  double real_time_factor = 1;
  /// Time starts once every topic that `Telemetry` has recorded has a subscriber, so a recorder misses nothing.
  bool wait_for_subscribers = false;
  /// Bag file to record to, complete when the node ends; empty: none. Needs `publish_clock`.
  std::string bag;
  /// Whether the node ends where the bag cannot be written any further; otherwise it runs on without.
  bool bag_required = true;
  /// Starts as after ~pause. Needs `publish_clock`.
  bool start_paused = false;
  /// Whether odom to base_footprint is published on /tf.
  bool publish_tf = true;
  /// `publish_rollers`; `publish_contacts`, which has them recorded; `world_tf`: world to odom, at the scene's initial
  /// pose, so that odometry and ground truth overlay, and world to ground_truth/base_footprint; `joint_velocity_sign`:
  /// driver_exact (reversed on the left, the default) or consistent (with positions); `friction_marker_scale` (m/N)
  /// and `slip_marker_scale` (m for each m/s).
  Telemetry::Options telemetry;
  /// Whether youBotHasArms is true. Diagnostics report that there is no arm in either case.
  bool has_arms = false;
};

/// Reads and checks all parameters. Throws ParameterError for a bad, unknown or contradictory one.
BaseSettings read_base_settings();

}  // namespace youbot_base_sim
