#pragma once

#include <geometry_msgs/WrenchStamped.h>
#include <ros/ros.h>
#include <youbot_base_sim/SetLoads.h>

#include <functional>

#include "youbot_base_sim/ros/base_loop.h"
#include "youbot_base_sim/ros/throttled_log.h"

namespace youbot_base_sim {

/// What pushes the base and what it carries: topic ~wrench (geometry_msgs/WrenchStamped, held until the next one) and
/// service ~set_loads. Enqueues for the control loop.
class BurdenInterface {
 public:
  /// `now` tells the simulated time at which what comes now arrives, s. All references must outlive it.
  BurdenInterface(BaseLoop& loop, const std::function<double()>& now, ros::NodeHandle& private_node, ThrottledLog& log);

 private:
  void receive(const geometry_msgs::WrenchStamped& message);
  bool set_loads(SetLoads::Request& request, SetLoads::Response& response);

  BaseLoop& loop_;
  std::function<double()> now_;
  ThrottledLog& log_;
  ros::Subscriber subscriber_;
  ros::ServiceServer service_;
};

}  // namespace youbot_base_sim
