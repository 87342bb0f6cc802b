#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_srvs/Empty.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "youbot_base_sim/ros/bag.h"
#include "youbot_base_sim/ros/base_loop.h"
#include "youbot_base_sim/ros/base_settings.h"
#include "youbot_base_sim/ros/burden_interface.h"
#include "youbot_base_sim/ros/clock_followers.h"
#include "youbot_base_sim/ros/contact_markers.h"
#include "youbot_base_sim/ros/driver_interface.h"
#include "youbot_base_sim/ros/lockstep.h"
#include "youbot_base_sim/ros/pacer.h"
#include "youbot_base_sim/ros/publications.h"
#include "youbot_base_sim/ros/schedule.h"
#include "youbot_base_sim/ros/step_service.h"
#include "youbot_base_sim/ros/throttled_log.h"
#include "youbot_base_sim/ros/wait_notice.h"

namespace youbot_base_sim {

/// The simulated base as a ROS node: what `DriverInterface` enqueues goes into a `BaseLoop`, what that tells is
/// published. It runs either by the wall clock or as the master of simulated time. Then it also publishes /clock and
/// has the services ~pause, ~unpause, ~reset (std_srvs/Empty) and ~step (youbot_base_sim/Step).
///
/// The loop stops where somebody could notice: at instants of publishing, if anybody listens, and every 20 ms at least;
/// a control period is never divided. Where it waits, it takes callbacks, and looks every 0.1 s whether ROS goes on.
///
/// While the driver has no base, as after a loss of EtherCAT, odom, base/joint_states and /tf stop, as the driver's do.
class BaseNode {
 public:
  /// Needs ros::init. Throws ParameterError if the bag cannot be opened.
  explicit BaseNode(const BaseSettings& settings);

  /// Runs until ROS shuts down. Throws std::runtime_error where anything that would be published is not finite, or if
  /// the bag cannot be written and is required.
  void run();

 private:
  using SteadyClock = std::chrono::steady_clock;

  void open_bag();
  void advertise();
  void publish_world();
  void offer_services();

  void go_on_to_the_end();
  void await_subscribers();
  bool await_command();
  void go_on_without_command();
  void idle();
  void go_on_when_due();
  void go_on_by_step();
  bool is_stepping() const { return step_service_ && step_service_->asked(); }
  void end_step(const char* reason);
  void take_callbacks(double timeout);
  void tell_wait(const std::string& what);
  std::int64_t periods_ahead() const;
  double wait_for_periods_ahead() const;
  void advance(std::int64_t periods);
  void tell_tipping();
  void publish_instant();
  void publish_stop();
  void record_telemetry();
  void publish_telemetry();
  void publish_diagnostics_when_due(double t);
  void publish_diagnostics(double t);
  template <class Write>
  void record(const Write& write);
  void announce_time();
  void see_who_listens();
  ros::Time stamp(double t) const;
  double now() const;

  bool pause(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool unpause(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool reset(std_srvs::Empty::Request&, std_srvs::Empty::Response&);

  const BaseSettings settings_;
  const bool keeps_pace_;  // with the wall clock or with commands, each control period
  BaseLoop loop_;
  Lockstep lockstep_;
  ClockFollowers followers_;
  Pacer pacer_;
  SpeedMeter speed_;
  Schedule diagnosing_;
  ContactMarkers markers_;
  std::unique_ptr<BagWriter> bag_;  // null: not recorded, or not any longer
  std::string bag_failure_;         // why; empty: none
  ThrottledLog log_;
  WaitNotice notice_;
  SteadyClock::time_point wait_told_;   // in diagnostics
  std::optional<double> tipping_told_;  // time at which the base tipped that was logged last, s

  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::NodeHandle private_node_;
  Publications publications_;
  std::optional<tf2_ros::StaticTransformBroadcaster> static_transforms_;
  std::unique_ptr<DriverInterface> interface_;
  std::unique_ptr<BurdenInterface> burden_interface_;
  std::vector<ros::ServiceServer> services_;
  std::optional<StepService> step_service_;

  ros::Time wall_start_;             // wall time of t = 0; zero before that
  std::int64_t idle_periods_ = 0;    // of lockstep by which /clock went on before the first command
  std::int64_t commands_taken_ = 0;  // command messages that had come when the last control period began
  bool paused_;
  bool ended_ = false;
  bool telemetry_is_wanted_ = false;  // by anybody, switches included
  bool periods_are_wanted_ = false;   // somebody could notice each control period's end
};

}  // namespace youbot_base_sim
