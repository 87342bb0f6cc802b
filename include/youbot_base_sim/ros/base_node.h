#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_srvs/Empty.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <youbot_base_sim/Step.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "youbot_base_sim/drive/base_driver.h"
#include "youbot_base_sim/ros/bag.h"
#include "youbot_base_sim/ros/base_settings.h"
#include "youbot_base_sim/ros/driver_interface.h"
#include "youbot_base_sim/ros/pacer.h"
#include "youbot_base_sim/ros/schedule.h"
#include "youbot_base_sim/ros/telemetry.h"
#include "youbot_base_sim/ros/throttled_log.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// The simulated base as a ROS node: takes what `DriverInterface` does, publishes what `Telemetry` and `diagnostics.h`
/// tell, and runs the control loop, either by the wall clock or as the master of simulated time. Then it also publishes
/// /clock and has the services ~pause, ~unpause, ~reset (std_srvs/Empty) and ~step (youbot_base_sim/Step).
///
/// While the driver has no base, as after a loss of EtherCAT, odom, base/joint_states and /tf stop, as the driver's do.
class BaseNode {
 public:
  /// Needs ros::init. Throws ParameterError if the bag cannot be opened.
  explicit BaseNode(const BaseSettings& settings);

  /// Runs until ROS shuts down.
  void run();

 private:
  void open_bag();
  void advertise();
  void publish_world();
  void offer_services();

  void await_subscribers();
  void go_by_wall_clock();
  void catch_up();
  bool take_commands();
  void advance();
  void advance_period();
  void publish_instant();
  void announce_time();
  void publish_diagnostics();
  template <class Make>
  void publish(const char* topic, const Make& make);
  ros::Time stamp(double t) const;
  MotorReadings read_motors();

  bool pause(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool unpause(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool reset(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool step(Step::Request& request, Step::Response& response);

  const BaseSettings settings_;
  BaseDriver driver_;
  Simulation simulation_;
  Telemetry telemetry_;
  Pacer pacer_;
  Schedule publishing_, listening_, diagnosing_;
  std::unique_ptr<BagWriter> bag_;  // null: not recorded
  ThrottledLog log_;

  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::NodeHandle private_node_;
  std::map<std::string, ros::Publisher, std::less<>> publishers_;  // by topic
  std::optional<tf2_ros::StaticTransformBroadcaster> static_transforms_;
  std::unique_ptr<DriverInterface> interface_;
  std::vector<ros::ServiceServer> services_;

  ros::Time wall_start_;             // wall time of t = 0
  std::int64_t commands_taken_ = 0;  // messages that control periods have used up
  bool paused_;
  const bool takes_commands_as_they_come_;
};

}  // namespace youbot_base_sim
