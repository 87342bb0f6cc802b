#pragma once

#include <string>
#include <vector>

#include "youbot_base_sim/loop/base_sensors.h"
#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/ros/topics.h"
#include "youbot_base_sim/ros/view/contact_markers.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// Makes the messages about the base, the same for the node and for bags: what docs/node.md says of the topics here.
class Telemetry {
 public:
  struct Options {
    /// Rates and efforts on the left have the reversed sign of their motors, as in the driver's messages.
    bool driver_velocity_sign = false;
    bool casters = true;    ///< the driver's caster_joint_fl and so on in the joint states, at zero
    bool rollers = false;   ///< roller_joint_fl_0 and so on in the joint states
    bool contacts = false;  ///< recorded too
    bool world = false;     ///< where odom and the base's true place are in the scene's frame, on /tf_static and /tf
    FrameNames frames;
    MarkerOptions markers;
  };

  /// Telemetry of the robot of `scene`.
  Telemetry(const Scene& scene, const Options& options);

  /// Calls `topic(row, make)` for each topic that has one message an instant; make() makes it, with `stamp`, from
  /// `simulation` and the last update of `sensors`.
  template <class Topic>
  void visit(const Simulation& simulation, const BaseSensors& sensors, const ros::Time& stamp, Topic&& topic) const {
    topic(kOdometryTopic, [&] { return odometry(sensors, stamp); });
    topic(kGroundTruthTopic, [&] { return truth(simulation.state(), stamp); });
    topic(kJointStatesTopic, [&] { return joint_states(simulation, sensors.readings(), stamp); });
    if (sensors.imu()) topic(kImuTopic, [&] { return imu_message(*sensors.imu(), stamp, imu_frame(*sensors.imu())); });
    topic(kTransformsTopic, [&] { return transforms(simulation, sensors, stamp); });
    topic(kContactsTopic, [&] { return contacts_message(simulation, stamp, options_.frames.base); });
    const std::vector<Wrench>& wrenches = simulation.applied_loads().wrenches;
    if (!wrenches.empty()) topic(kAppliedWrenchTopic, [&] { return push(wrenches, simulation.state().psi(), stamp); });
  }

  /// Calls `topic(row, stamp, make)` for each event; `stamp_at(t)` makes the stamp of simulated time t, s.
  template <class StampAt, class Topic>
  void visit(const Events& events, const StampAt& stamp_at, Topic&& topic) const {
    const FrameNames& frames = options_.frames;
    for (const RollerSwitch& event : events.switches) {
      const ros::Time stamp = stamp_at(event.t);
      topic(kRollerSwitchesTopic, stamp, [&] { return roller_switch_message(event, stamp, frames); });
    }
    for (const LoadChange& change : events.load_changes) {
      const ros::Time stamp = stamp_at(change.t);
      const AppliedLoads& applied = change.applied;
      if (change.loads)
        topic(kLoadsTopic, stamp, [&] { return loads_message(applied.loads, stamp, frames.base_link()); });
      if (change.wrenches) topic(kAppliedWrenchTopic, stamp, [&] { return push(applied.wrenches, change.psi, stamp); });
    }
    for (const StateChange& change : events.state_changes) {
      const ros::Time stamp = stamp_at(change.t);
      topic(kStateSetTopic, stamp, [&] { return truth(change.state, stamp); });
    }
  }

  visualization_msgs::MarkerArray markers(const Simulation& simulation, const ros::Time& stamp) {
    return markers_.at(contacts_message(simulation, stamp, options_.frames.base), simulation);
  }

  /// True if the settings allow the topic to be recorded and awaited. It is published either way.
  bool is_requested(const TopicRow& topic) const { return options_.contacts || !topic.is(kOnRequest); }

  /// For /tf_static: where odometry starts in the scene's frame, if that is wanted, and where the inertial unit is, if
  /// not in the middle of the base.
  tf2_msgs::TFMessage static_transforms(const Simulation& simulation, const BaseSensors& sensors,
                                        const ros::Time& stamp) const;

 private:
  static bool is_apart(const Imu& imu) { return !imu.position().isZero(0); }
  std::string imu_frame(const Imu& imu) const {
    return is_apart(imu) ? options_.frames.imu_link() : options_.frames.base;
  }
  static Eigen::Vector3d pose_of(const State& state) { return {state.x(), state.y(), state.psi()}; }
  nav_msgs::Odometry odometry(const BaseSensors& sensors, const ros::Time& stamp) const;
  nav_msgs::Odometry truth(const State& state, const ros::Time& stamp) const {
    return odometry_message(options_.frames.world, pose_of(state), state.velocity(), stamp, options_.frames.base);
  }
  geometry_msgs::WrenchStamped push(const std::vector<Wrench>& wrenches, double psi, const ros::Time& stamp) const {
    return wrench_message(wrenches, psi, stamp, options_.frames.base_link());
  }
  sensor_msgs::JointState joint_states(const Simulation& simulation, const MotorReadings& readings,
                                       const ros::Time& stamp) const;
  tf2_msgs::TFMessage transforms(const Simulation& simulation, const BaseSensors& sensors,
                                 const ros::Time& stamp) const;

  Options options_;
  ContactMarkers markers_;
  sensor_msgs::JointState joints_;  // with names, and zeros for the rest
};

}  // namespace youbot_base_sim
