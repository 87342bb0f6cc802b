#pragma once

#include <geometry_msgs/Twist.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_srvs/Empty.h>
#include <youbot_base_sim/Step.h>

#include <chrono>
#include <map>
#include <memory>
#include <string>

#include "youbot_base_sim/drive/wheel_drive.h"
#include "youbot_base_sim/record/bag.h"
#include "youbot_base_sim/ros/pacer.h"
#include "youbot_base_sim/ros/telemetry.h"
#include "youbot_base_sim/scene/scene.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// The simulated base as a ROS node: takes the driver's commands, publishes what `Telemetry` tells, and runs the
/// control loop, either by the wall clock or as the master of simulated time.
///
/// Subscribes (queue 1000, as the driver):
///   cmd_vel                               geometry_msgs/Twist, by the driver's kinematics to wheel rates
///   base/base_controller/torques_command  brics_actuator/JointTorques, at the wheels
///   base/base_controller/velocity_command brics_actuator/JointVelocities, kept by the wheels' velocity loop
/// A command holds until the next one for the same wheel: there is no watchdog, as the driver has none. At the start
/// the wheels are held at rest, as the driver's.
///
/// Publishes the topics of `Telemetry`, and /clock, the services ~pause, ~unpause, ~reset (std_srvs/Empty) and ~step
/// (youbot_base_sim/Step) if it is the master of time.
class BaseNode {
 public:
  /// The node's private parameters, by their names.
  struct Settings {
    /// `scene`: a scene file, of which robot, floor, initial state, model and solver count and the drive does not. Left
    /// out: the paper's robot at rest at the origin. `model`: in place of the scene's. `control_period` (s): likewise;
    /// 1 ms if neither says.
    Scene scene;
    /// Instants of publishing a second, Hz; the driver's rate by default. Also the rate at which odometry is
    /// integrated.
    double publish_rate = 50;
    /// Whether the node is the master of simulated time: publishes /clock, stamps with simulated time, and has the
    /// services. Needs /use_sim_time for everybody else to follow. Otherwise stamps are wall time.
    bool publish_clock = false;
    /// Simulated seconds a second; 0: as fast as it can. Other than 1 only with `publish_clock`.
    double real_time_factor = 1;
    /// Each control period waits for one command message: a player that answers each /clock message with a command is
    /// thereby obeyed in every period, however slow it is. Only with `publish_clock`.
    bool lockstep = false;
    /// Time starts when each published topic has a subscriber, so that a recorder misses nothing.
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
    /// Whether the joint states tell of the rollers too.
    bool publish_rollers = false;
    /// Wheel radius of the driver's kinematics, for `odom` and `cmd_vel`, m. The driver believes in 0.0475 m.
    double driver_wheel_radius = DriverKinematics().wheel_radius;
  };

  /// Reads and checks the private parameters. Throws ParameterError.
  static Settings read_settings();

  /// Needs ros::init. Throws ParameterError if the bag cannot be opened.
  explicit BaseNode(const Settings& settings);

  /// Runs until ROS shuts down.
  void run();

 private:
  using SteadyClock = std::chrono::steady_clock;

  void open_bag();
  void advertise();
  void publish_world();
  void subscribe();
  void offer_services();

  void await_subscribers();
  bool take_commands();
  void advance();
  void publish_instant();
  void announce_time();
  template <class Make>
  void publish(const char* topic, const Make& make);
  ros::Time stamp(double t) const;

  void take_torques(const brics_actuator::JointTorques& message);
  void take_velocities(const brics_actuator::JointVelocities& message);
  void take_twist(const geometry_msgs::Twist& message);
  void obey(const char* topic, const WheelCommand& command, bool (WheelDrive::*set)(int, double));
  void hold_wheels();
  void warn(const std::string& subject, const std::string& text);

  bool pause(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool unpause(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool reset(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool step(Step::Request& request, Step::Response& response);

  const Settings settings_;
  const DriverKinematics kinematics_;
  WheelDrive drive_;
  Simulation simulation_;
  Telemetry telemetry_;
  Pacer pacer_;
  std::unique_ptr<BagWriter> bag_;  // null: not recorded

  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::NodeHandle private_node_;
  std::map<std::string, ros::Publisher> publishers_;  // by topic
  ros::Publisher static_transforms_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::ServiceServer> services_;

  ros::Time wall_start_;            // wall time of t = 0
  std::int64_t instants_ = 0;       // published
  std::int64_t commands_left_ = 0;  // messages that no control period has used up yet
  bool paused_;
  std::map<std::string, SteadyClock::time_point> last_warning_;  // by subject
};

}  // namespace youbot_base_sim
