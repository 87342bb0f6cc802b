#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "youbot_base_sim/loop/base_loop.h"
#include "youbot_base_sim/loop/instants.h"
#include "youbot_base_sim/loop/wait_notice.h"
#include "youbot_base_sim/ros/bag.h"
#include "youbot_base_sim/ros/base_settings.h"
#include "youbot_base_sim/ros/clock_policy.h"
#include "youbot_base_sim/ros/contact_markers.h"
#include "youbot_base_sim/ros/driver_interface.h"
#include "youbot_base_sim/ros/publications.h"
#include "youbot_base_sim/ros/telemetry.h"
#include "youbot_base_sim/ros/throttled_log.h"
#include "youbot_base_sim/ros/time_services.h"

namespace youbot_base_sim {

/// The simulated base as a ROS node: what `DriverInterface` enqueues goes into a `BaseLoop`, whose state and sensors
/// are published. A `ClockPolicy` says when. As the master of simulated time the node also has `TimeServices`.
///
/// The loop stops where that could be noticed: at instants of publishing, if a topic is heard, and every 20 ms at
/// least; a control period is never divided. Where it waits, it takes callbacks, and looks every 0.1 s whether ROS
/// still runs.
///
/// While the driver has no base, as after a loss of EtherCAT, odom, base/joint_states and /tf stop, as the driver's do.
class BaseNode : private ClockOwner {
 public:
  /// Needs ros::init. Throws ParameterError if the bag cannot be opened.
  explicit BaseNode(const BaseSettings& settings);

  /// Runs until ROS shuts down. Throws std::runtime_error where anything that would be published is not finite, or if
  /// the bag cannot be written and is required.
  void run();

 private:
  /// The node's own bag.
  struct Bag {
    std::unique_ptr<BagWriter> writer;  ///< null: not recorded, or not any longer
    std::string failure;                ///< why; empty: none
  };
  /// What is heard or recorded now.
  struct Wanted {
    bool telemetry = false;  ///< any of it, switches included
    bool periods = false;    ///< the end of each control period could be noticed
  };

  void open_bag();
  void advertise();
  void publish_world();
  void offer_time_services();

  void run_loop();
  void report_start();
  void await_subscribers();
  void advance_when_due();
  void advance_by_step();
  void take_callbacks(double timeout);
  std::int64_t periods_ahead() const;
  double wait_for_periods_ahead();
  void advance(std::int64_t periods);
  void log_tipping();
  void publish_instant();
  void record_telemetry();
  void publish_diagnostics_when_due(double t);
  void publish_diagnostics(double t);
  template <class Write>
  void record(const Write& write);
  void update_subscriptions();
  bool paused() const { return time_services_ && time_services_->paused(); }
  bool stepping() const { return time_services_ && time_services_->stepping(); }
  bool reset();

  const DriverInterface& commands() const override { return *interface_; }
  ros::CallbackQueue& queue() override { return queue_; }
  bool interrupted() const override { return paused() || stepping() || !node_.ok(); }
  void report_wait(const std::string& what) override;
  void publish_telemetry() override;
  void end() override { ended_ = true; }

  const BaseSettings settings_;
  BaseLoop loop_;
  Telemetry telemetry_;
  ContactMarkers markers_;
  Instants diagnosing_;
  Bag bag_;
  ThrottledLog log_;
  WaitNotice notice_;
  std::optional<double> tipping_logged_;  // when the base tipped, s

  ros::CallbackQueue queue_;
  ros::NodeHandle node_, private_node_;
  Publications publications_;
  std::unique_ptr<ClockPolicy> clock_;
  std::optional<tf2_ros::StaticTransformBroadcaster> static_transforms_;
  std::unique_ptr<DriverInterface> interface_;
  std::optional<TimeServices> time_services_;

  Wanted wanted_;
  bool ended_ = false;
};

}  // namespace youbot_base_sim
