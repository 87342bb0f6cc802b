#pragma once

#include <sensor_msgs/JointState.h>
#include <tf2_msgs/TFMessage.h>

#include "youbot_base_sim/drive/wheel_odometry.h"
#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// Everything that the base tells about itself, for the node and for bags alike, so that both have the same topics,
/// frames and contents:
///
///   odom                 nav_msgs/Odometry, odom to base_footprint, from the wheels as the driver computes it
///   ground_truth         nav_msgs/Odometry, world to base_footprint: the exact pose and velocity
///   base/joint_states    sensor_msgs/JointState: the four wheels and the driver's four casters, which stand at zero;
///                        effort is the drives' torque at the wheels, N m; the rollers too on request
///   /tf                  odom to base_footprint
///   base/roller_switches youbot_base_sim/RollerSwitchStamped, one message a switch
class Telemetry {
 public:
  struct Options {
    DriverKinematics kinematics;  ///< of `odom`
    bool rollers = false;         ///< roller_joint_fl_0 and so on in the joint states
  };

  Telemetry(const Simulation& simulation, const Options& options);

  /// Takes in the simulation's present state, as the driver does once a cycle: the wheel odometry makes one step.
  void update(const Simulation& simulation);

  /// Starts again from the simulation's present state, with the odometry at zero.
  void reset(const Simulation& simulation);

  /// Calls `topic(name, make)` for each topic that has one message an instant; make() makes the one of the last update,
  /// with `stamp`. What is not wanted need not be made.
  template <class Topic>
  void visit(const ros::Time& stamp, Topic&& topic) const {
    topic("odom", [&] { return odometry(stamp); });
    topic("ground_truth", [&] { return ground_truth(stamp); });
    topic("base/joint_states", [&] { return joint_states(stamp); });
    topic("/tf", [&] { return transforms(stamp); });
  }

  /// Topic of `roller_switch_message`s.
  static constexpr char kSwitches[] = "base/roller_switches";

  nav_msgs::Odometry odometry(const ros::Time& stamp) const;
  nav_msgs::Odometry ground_truth(const ros::Time& stamp) const;
  sensor_msgs::JointState joint_states(const ros::Time& stamp) const;
  tf2_msgs::TFMessage transforms(const ros::Time& stamp) const;

 private:
  void take_in(const Simulation& simulation);

  WheelOdometry odometry_;
  bool with_rollers_;
  State state_;
  sensor_msgs::JointState joints_;  // names and numbers of the last update
};

}  // namespace youbot_base_sim
