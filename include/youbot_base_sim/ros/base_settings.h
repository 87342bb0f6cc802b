#pragma once

#include <string>

#include "youbot_base_sim/loop/base_loop.h"
#include "youbot_base_sim/ros/telemetry.h"

namespace youbot_base_sim {

/// The parameters of base_node: its private ones, named as the members here, and those of the real driver, which are
/// relative to the node's namespace:
///
///   youBotHasBase                  must be true: the node simulates nothing else
///   youBotHasArms                  may be true, as in the driver's launch file, but no arm is found
///   youBotDriverCycleFrequencyInHz default of `publish_rate` and `command_rate`, Hz
///   youBotConfigurationFilePath    folder of the file youBotBaseName.cfg with the base's motors and kinematics
///   youBotBaseName                 "youbot-base" by default
///
/// The driver's other parameters concern arms and are ignored.
///
/// Of LoopSettings: `scene` comes from the parameters `scene` (a scene file; its `drive` section is ignored), `model`,
/// `method`, `profile`, `friction_scale`, `relative_tolerance`, `control_period` (s), `dry_friction` (N m, of each
/// wheel's drive), `initial_pose` (x, y, heading, m and rad) and `initial_wheel_angles` (rad); each overrides the
/// scene's value. Without a scene file: the paper's robot with the measured profile, at rest at the origin, a relative
/// tolerance of 1e-5 and a control period of 1 ms. The two rates are at most once a control period. `driver` has
/// `command_timeout` (s) and, in place of the scene's section `motors`, what MotorSettings has; `sensors`,
/// `driver_wheel_radius` (m), `odometry_wheel_error` and, with `publish_imu`, the errors of the inertial unit.
///
/// `lockstep`, which needs `publish_clock`, has `lockstep_period` (s), `lockstep_timeout` (s) and `end_with_commands`;
/// see LockstepSettings. /clock advances by that period once the nodes that follow it rest, and so have dealt with all
/// that was published before; what they command then acts in the period. The simulation begins with the first command
/// or ~unpause; until then only /clock advances. Messages that come while time stands still count as one.
struct BaseSettings : LoopSettings {
  /// The node is the master of simulated time: publishes /clock, stamps messages with it and offers the time services.
  /// Other nodes follow only if /use_sim_time is true. Otherwise the node follows another's /clock if /use_sim_time is
  /// true, else the wall clock.
  bool publish_clock = false;
  /// Simulated seconds per second, 0.001 or more; 0: as fast as possible. Other values than 1 need `publish_clock`.
  double real_time_factor = 1;
  /// Time starts once every recorded topic of `Telemetry` has a subscriber, so a recorder misses nothing.
  bool wait_for_subscribers = false;
  std::string bag;            ///< file to record to, complete when the node ends; empty: none. Needs `publish_clock`
  bool bag_required = true;   ///< the node ends if the bag cannot be written; otherwise it goes on without
  bool start_paused = false;  ///< starts as after ~pause. Needs `publish_clock`
  double end_time = 0;        ///< simulated time at which the node ends, s; 0: none
  bool listen_to_initialpose = false;  ///< to put the base where rviz's "2D Pose Estimate" has it; amcl listens too
  bool publish_tf = true;              ///< whether odom to base_footprint is published on /tf
  /// `odom_frame`, `base_frame` and `world_frame`, the first two with the `tf_prefix` of the nearest namespace;
  /// `publish_rollers`; `publish_contacts`, which has them recorded; `world_tf`: world to odom, at the scene's initial
  /// pose, and world to ground_truth/base_footprint; `joint_velocity_sign`: driver_exact (reversed on the left, the
  /// default) or consistent (with positions); `friction_marker_scale` (m/N) and `slip_marker_scale` (m for each m/s).
  Telemetry::Options telemetry;
};

/// Reads and checks all parameters: the driver's in the namespace of `node`, the others in that of `private_node`.
/// Throws ParameterError for a bad, unknown or contradictory one.
BaseSettings read_base_settings(const ros::NodeHandle& node = {},
                                const ros::NodeHandle& private_node = ros::NodeHandle("~"));

}  // namespace youbot_base_sim
