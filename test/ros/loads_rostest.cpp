// ~wrench pushes the base and ~set_loads loads it; what they cannot take is refused and changes nothing.

#include <geometry_msgs/WrenchStamped.h>
#include <youbot_base_sim/SetLoads.h>

#include <limits>

#include "log.h"

namespace youbot_base_sim {
namespace {

geometry_msgs::WrenchStamped push(const std::string& frame, double x, double y) {
  geometry_msgs::WrenchStamped message;
  message.header.frame_id = frame;
  message.wrench.force.x = x;
  message.wrench.force.y = y;
  return message;
}

SetLoads::Response set_loads(double mass, double x, double inertia = 0) {
  SetLoads service;
  service.request.loads.resize(1);
  service.request.loads[0].mass = mass;
  service.request.loads[0].position.x = x;
  service.request.loads[0].inertia = inertia;
  EXPECT_TRUE(ros::service::call("base_node/set_loads", service));
  return service.response;
}

class Pusher {
 public:
  explicit Pusher(BaseClient& base) {
    base.wait_for("the node to listen", [this] { return publisher_.getNumSubscribers() == 1; });
  }
  // Wrenches come by a connection of their own: some of the commands that follow may overtake them.
  void publish(const geometry_msgs::WrenchStamped& message) { publisher_.publish(message); }

 private:
  ros::NodeHandle node_;
  ros::Publisher publisher_ = node_.advertise<geometry_msgs::WrenchStamped>("base_node/wrench", 10);
};

TEST(Wrench, pushes_the_base_until_the_next_one) {
  BaseClient& base = BaseClient::fresh();
  Pusher pusher(base);
  pusher.publish(push("base_link", 0, 200));
  for (int k = 0; k < 2000 && base.truth.pose.pose.position.y < 0.01; ++k) base.idle(1);
  EXPECT_GT(base.truth.pose.pose.position.y, 0.01);
  pusher.publish(push("base_link", 0, 0));
  for (int k = 0; k < 2000 && base.truth.twist.twist.linear.y > 0.01; ++k) base.idle(1);
  EXPECT_LT(base.truth.twist.twist.linear.y, 0.01);
}

TEST(Wrench, that_is_of_no_use_is_refused) {
  BaseClient& base = BaseClient::fresh();
  Pusher pusher(base);
  pusher.publish(push("gripper", 0, 200));
  pusher.publish(push("base_link", std::numeric_limits<double>::quiet_NaN(), 200));
  pusher.publish(push("base_link", 0, 1e7));
  geometry_msgs::WrenchStamped tilting = push("base_link", 0, 200);
  tilting.wrench.torque.x = 1;
  pusher.publish(tilting);
  for (int k = 0; k < 100; ++k) base.idle(1);
  EXPECT_EQ(base.truth.pose.pose.position.y, 0);
  pusher.publish(push("base_link", 0, 200));  // comes after all of them
  for (int k = 0; k < 2000 && base.truth.pose.pose.position.y == 0; ++k) base.idle(1);
  EXPECT_GT(base.truth.pose.pose.position.y, 0);
}

TEST(Wrench, that_pushes_down_to_no_effect_is_warned_of) {
  BaseClient& base = BaseClient::fresh();
  Log& log = Log::of(base);
  Pusher pusher(base);
  geometry_msgs::WrenchStamped down = push("base_link", 0, 0);
  pusher.publish(down);
  down.wrench.force.z = -20;
  pusher.publish(down);
  log.expect(base, rosgraph_msgs::Log::WARN, {"wrench.force.z = -20", "no effect", "normal_reactions is dynamic"});
  EXPECT_EQ(log.count(rosgraph_msgs::Log::WARN, "no effect"), 1u);
}

TEST(Loads, are_set_or_refused_by_name) {
  BaseClient& base = BaseClient::fresh();
  EXPECT_TRUE(set_loads(10, 0.1).success);
  base.idle(1);
  const auto expect_refused = [](const SetLoads::Response& response, const std::string& name) {
    EXPECT_FALSE(response.success);
    EXPECT_NE(response.message.find(name), std::string::npos) << response.message;
  };
  expect_refused(set_loads(-1, 0), "loads[0].mass = -1");
  expect_refused(set_loads(1, std::numeric_limits<double>::infinity()), "loads[0].position.x = inf");
  expect_refused(set_loads(1, 0, -2), "loads[0].inertia = -2");
  expect_refused(set_loads(100, 2), "every wheel presses on the floor");
  base.idle(10);
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
