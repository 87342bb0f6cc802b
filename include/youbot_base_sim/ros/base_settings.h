#pragma once

#include <string>
#include <vector>

#include "youbot_base_sim/loop/base_loop.h"
#include "youbot_base_sim/ros/program.h"
#include "youbot_base_sim/ros/telemetry.h"

namespace youbot_base_sim {

/// Simulated time waits until all nodes that follow /clock rest, or for the commands of a player, which answers each
/// /clock message with one.
struct LockstepSettings {
  bool on = false;
  double period = 0;    ///< step of /clock for nodes that rest, s, a multiple of the control period; 0: for a player
  double timeout = 10;  ///< wall time to wait for a node to rest, or for the command of a player that may end, s
  bool strict = true;   ///< a run in which time has not waited for a node ends with an error
  std::vector<std::string> wait_for;  ///< nodes that say when they are done with a step; empty: all that follow /clock
  bool end_with_commands = false;     ///< the node ends when the last publisher of commands is gone
};

/// The parameters of base_node: its private ones, named as the members here and listed in docs/node.md, and those of
/// the real driver (docs/drop_in.md), which are relative to the node's namespace.
///
/// Without a scene file `scene` is the paper's robot with the measured profile, at rest at the origin, with a relative
/// tolerance of 1e-5 and a control period of 1 ms. The two rates are at most once a control period. `driver` has the
/// scene's section `motors` unless a parameter replaces it. `lockstep` needs `publish_clock`.
struct BaseSettings : LoopSettings {
  /// The node is the master of simulated time: publishes /clock, stamps messages with it and offers the time services.
  /// Other nodes follow only if /use_sim_time is true. Otherwise the node follows another's /clock if /use_sim_time is
  /// true, else the wall clock.
  bool publish_clock = false;
  /// Simulated seconds per second, 0.001 or more; 0: as fast as possible. Other values than 1 need `publish_clock`.
  double real_time_factor = 1;
  /// Time starts once every topic that is `kAwaited` has a subscriber, so it misses nothing.
  bool wait_for_subscribers = false;
  LockstepSettings lockstep;
  std::string bag;                     ///< file to record to, complete when the node ends; empty: none
  bool bag_required = true;            ///< the node ends if the bag cannot be written; otherwise it goes on without
  bool start_paused = false;           ///< starts as after ~pause. Needs `publish_clock`
  double end_time = 0;                 ///< simulated time at which the node ends, s; 0: none
  bool listen_to_initialpose = false;  ///< to put the base where rviz's "2D Pose Estimate" has it; amcl listens too
  bool has_arms = false;               ///< an arm is missed: platform_Arm of /diagnostics is an error, as the driver's
  bool publish_tf = true;              ///< whether odom to base_footprint is published on /tf
  Telemetry::Options telemetry;        ///< names of frames, sign of joint velocities, what else is published
};

/// Reads and checks all parameters, the driver's apart. Throws ParameterError for a bad, unknown or contradictory one.
BaseSettings read_base_settings(Parameters parameters, Parameters driver_parameters);

}  // namespace youbot_base_sim
