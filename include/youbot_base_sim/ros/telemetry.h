#pragma once

#include <sensor_msgs/JointState.h>
#include <tf2_msgs/TFMessage.h>

#include "youbot_base_sim/drive/motor_sensors.h"
#include "youbot_base_sim/drive/wheel_odometry.h"
#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// Everything that the base tells about itself, for the node and for bags alike, so that both have the same topics,
/// frames and contents:
///
///   odom                 nav_msgs/Odometry, odom to base_footprint, from the wheels as the driver computes it
///   ground_truth         nav_msgs/Odometry, world to base_footprint: the exact pose and velocity
///   base/joint_states    sensor_msgs/JointState: the four wheels as their motors tell, and the driver's four casters,
///                        which stand at zero; effort is the motors' torque at the wheels, N m; the rollers too on
///                        request
///   /tf                  odom to base_footprint
///   base/roller_switches youbot_base_sim/RollerSwitchStamped, one message a switch
class Telemetry {
 public:
  struct Options {
    DriverKinematics kinematics;  ///< of `odom`
    double wheel_error = 0;       ///< for the covariances of `odom`, see WheelOdometry
    bool driver_velocity_sign =
        false;             ///< rates and efforts of the wheels on the left as their motors have them, which
                           ///< turn the other way round: what the driver publishes beside its positions
    bool rollers = false;  ///< roller_joint_fl_0 and so on in the joint states
  };

  /// Starts with the odometry at zero where the motors are that `readings` are of.
  Telemetry(const Simulation& simulation, const MotorReadings& readings, const Options& options);

  /// Takes in the simulation's present state and its motors' readings, as the driver does once a cycle: the wheel
  /// odometry makes one step.
  void update(const Simulation& simulation, const MotorReadings& readings);

  /// Has the odometry start again from zero, where the wheels were at the last update.
  void restart_odometry();

  /// Calls `topic(name, make)` for each topic that has one message an instant; make() makes the one of the last update,
  /// with `stamp`. What is not wanted need not be made.
  template <class Topic>
  void visit(const ros::Time& stamp, Topic&& topic) const {
    topic(kOdometryTopic, [&] { return odometry(stamp); });
    topic(kGroundTruthTopic, [&] { return ground_truth(stamp); });
    topic(kJointStatesTopic, [&] { return joint_states(stamp); });
    topic(kTransformsTopic, [&] { return transforms(stamp); });
  }

  nav_msgs::Odometry odometry(const ros::Time& stamp) const;
  nav_msgs::Odometry ground_truth(const ros::Time& stamp) const;
  sensor_msgs::JointState joint_states(const ros::Time& stamp) const;
  tf2_msgs::TFMessage transforms(const ros::Time& stamp) const;

 private:
  void take_in(const Simulation& simulation, const MotorReadings& readings);
  void take_in_rollers(const Simulation& simulation);

  Options options_;
  WheelOdometry odometry_;
  State state_;
  MotorReadings readings_;
  sensor_msgs::JointState joints_;  // names and numbers of the last update
};

/// The readings of motors that exert the simulation's torque and whose sensors have no error.
MotorReadings exact_readings(const Simulation& simulation);

}  // namespace youbot_base_sim
