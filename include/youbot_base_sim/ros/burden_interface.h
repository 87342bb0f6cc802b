#pragma once

#include <geometry_msgs/WrenchStamped.h>
#include <ros/ros.h>
#include <youbot_base_sim/SetLoads.h>

#include <functional>
#include <string>

#include "youbot_base_sim/physics/burden.h"
#include "youbot_base_sim/ros/base_loop.h"
#include "youbot_base_sim/ros/throttled_log.h"

namespace youbot_base_sim {

/// A wrench message as the simulation has it. Frames base_link, base_footprint and none are the platform's; in `world`
/// and `odom` the force keeps its direction in the fixed frame, and acts at the base all the same. The point is the
/// origin of base_link. `complaint` says why it cannot be taken; empty: it can.
Wrench wrench_of(const geometry_msgs::WrenchStamped& message, std::string& complaint);

/// Loads of a request, whose positions are in base_link. `complaint` as above.
std::vector<Load> loads_of(const SetLoads::Request& request, std::string& complaint);

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
