// What the services and topics of the simulation do: time, loads, wrenches, and where the base is.

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/WrenchStamped.h>
#include <ros/master.h>
#include <youbot_base_sim/SetLoads.h>
#include <youbot_base_sim/SetState.h>

#include <thread>

#include "joint_entry.h"
#include "log.h"

namespace youbot_base_sim {
namespace {

// The node is the master of time: it stands, goes by steps, runs, and starts again, as its services say.
TEST(TimeServices, step_and_run_and_reset) {
  BaseClient& base = BaseClient::fresh();
  EXPECT_EQ(base.time(), 0) << "starts paused";

  // Steps, to the period.
  EXPECT_TRUE(base.step(10).success);
  EXPECT_EQ(base.time(), 0.01);
  EXPECT_EQ(base.step(0).t, 0.01);

  // Runs when it is let go, and then refuses steps.
  base.unpause();
  wait_for("time to go on", [&] { return base.time() > 0.1; });
  const Step::Response refused = base.step(1);
  EXPECT_FALSE(refused.success);
  EXPECT_NE(refused.message.find("pause"), std::string::npos) << refused.message;

  // Stands when it is told to.
  base.pause();
  const double t = base.step(0).t;
  EXPECT_GT(t, 0.1);
  EXPECT_EQ(base.step(0).t, t);
  EXPECT_NEAR(base.step(1).t, t + 1e-3, 1e-9);

  base.reset();
  EXPECT_EQ(base.step(0).t, 0) << "paused as before";
}

TEST(TimeServices, step_of_any_length_leaves_all_else_served) {
  BaseClient& base = BaseClient::fresh();
  for (const char* ended_by : {"~pause", "~unpause", "~reset"}) {
    Step service;
    service.request.periods = 4000000000;
    std::thread step([&service] { EXPECT_TRUE(call_service("base_node/step", service)); });
    wait_for("the step", [&] { return base.time() > 1; });
    EXPECT_TRUE(base.call("base/switchOnMotors"));
    EXPECT_TRUE(base.call("base_node" + std::string(ended_by).replace(0, 1, "/")));
    step.join();
    EXPECT_FALSE(service.response.success);
    EXPECT_EQ(service.response.message, std::string("ended by ") + ended_by);
    EXPECT_GT(service.response.t, 1);
    base.pause();
    base.reset();
  }
}

TEST(TimeServices, reset_forgets_commands_and_odometry) {
  BaseClient& base = BaseClient::fresh();
  base.send(torque_message({1, 1, 1, 1}, {}));
  // Nothing tells when a command has arrived but what it does.
  wait_for("the command to act", [&] {
    base.step(100);
    return base.joints.effort[0] == 1;
  });
  base.step(1000);
  EXPECT_GT(base.truth.pose.pose.position.x, 0.01);
  EXPECT_GT(base.odometry.pose.pose.position.x, 0.01);

  base.reset();
  EXPECT_EQ(base.truth.pose.pose.position.x, 0);
  EXPECT_EQ(base.odometry.pose.pose.position.x, 0);
  base.step(100);
  for (int i = 0; i < kWheels; ++i) EXPECT_NEAR(base.joints.effort[i], 0, 1e-12) << kWheelNames[i];
}

// By default the node goes by the wall clock, as the robot does.
TEST(WallClock, paces_and_stamps) {
  ros::NodeHandle node;
  std::vector<ros::Time> stamps;
  double max_lead = 0, max_lag = 0;  // of stamps, against the wall clock, s
  const auto take = [&](const nav_msgs::Odometry::ConstPtr& message) {
    stamps.push_back(message->header.stamp);
    const double lag = (ros::Time::now() - message->header.stamp).toSec();
    max_lag = std::max(max_lag, lag);
    max_lead = std::max(max_lead, -lag);
  };
  const ros::Subscriber subscriber = node.subscribe<nav_msgs::Odometry>("odom", 1000, take);
  wait_for("odometry", [&] { return !stamps.empty(); });
  const ros::WallTime start = ros::WallTime::now();
  wait_for("100 more", [&] { return stamps.size() > 100; });
  const double wall = (ros::WallTime::now() - start).toSec();
  // 50 Hz; the bounds leave room for a busy machine, which may be late with anything but not early.
  EXPECT_LT(max_lead, 0.05) << "time goes faster than the wall clock";
  EXPECT_LT(max_lag, 5.0) << "stamps are wall time";
  EXPECT_NEAR((stamps[100] - stamps[0]).toSec(), wall, 5.0);
  for (std::size_t k = 1; k < stamps.size(); ++k) EXPECT_GT(stamps[k], stamps[k - 1]);
}

TEST(WallClock, leaves_time_alone) {
  ros::master::V_TopicInfo topics;
  ASSERT_TRUE(ros::master::getTopics(topics));
  for (const auto& topic : topics) EXPECT_NE(topic.name, "/clock");
  EXPECT_FALSE(ros::service::exists("base_node/pause", false));
}

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
  EXPECT_TRUE(call_service("base_node/set_loads", service));
  return service.response;
}

/// Who pushes the base by ~wrench.
class Pusher {
 public:
  Pusher() {
    wait_for("the node to listen", [this] { return publisher_.getNumSubscribers() == 1; });
  }
  // Wrenches come by a connection of their own: some of the commands that follow may overtake them.
  void publish(const geometry_msgs::WrenchStamped& message) { publisher_.publish(message); }

 private:
  ros::NodeHandle node_;
  ros::Publisher publisher_ = node_.advertise<geometry_msgs::WrenchStamped>("base_node/wrench", 10);
};

TEST(Wrench, pushes_the_base_until_the_next_one) {
  BaseClient& base = BaseClient::fresh();
  Pusher pusher;
  pusher.publish(push("base_link", 0, 200));
  for (int k = 0; k < 2000 && base.truth.pose.pose.position.y < 0.01; ++k) base.idle(1);
  EXPECT_GT(base.truth.pose.pose.position.y, 0.01);
  pusher.publish(push("base_link", 0, 0));
  for (int k = 0; k < 2000 && base.truth.twist.twist.linear.y > 0.01; ++k) base.idle(1);
  EXPECT_LT(base.truth.twist.twist.linear.y, 0.01);
}

TEST(Wrench, that_is_of_no_use_is_refused) {
  BaseClient& base = BaseClient::fresh();
  Pusher pusher;
  pusher.publish(push("gripper", 0, 200));
  pusher.publish(push("base_link", kNan, 200));
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
  Pusher pusher;
  geometry_msgs::WrenchStamped down = push("base_link", 0, 0);
  pusher.publish(down);
  down.wrench.force.z = -20;
  pusher.publish(down);
  log.expect(rosgraph_msgs::Log::WARN, {"wrench.force.z = -20", "no effect", "normal_reactions is dynamic"});
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
  expect_refused(set_loads(1, kInf), "loads[0].position.x = inf");
  expect_refused(set_loads(1, 0, -2), "loads[0].inertia = -2");
  expect_refused(set_loads(100, 2), "every wheel presses on the floor");
  base.idle(10);
}

geometry_msgs::Pose pose(double x, double y, double heading) {
  geometry_msgs::Pose pose;
  pose.position.x = x;
  pose.position.y = y;
  pose.orientation.z = std::sin(heading / 2);
  pose.orientation.w = std::cos(heading / 2);
  return pose;
}

SetState::Response set_state(const SetState::Request& request) {
  SetState service;
  service.request = request;
  EXPECT_TRUE(call_service("base_node/set_state", service));
  EXPECT_EQ(service.response.success, service.response.status_message.empty());
  return service.response;
}

void expect_at(const nav_msgs::Odometry& message, double x, double y, double psi, double tolerance = 1e-9) {
  EXPECT_NEAR(message.pose.pose.position.x, x, tolerance);
  EXPECT_NEAR(message.pose.pose.position.y, y, tolerance);
  EXPECT_NEAR(heading(message.pose.pose.orientation), psi, tolerance);
}

TEST(SetState, begins_where_the_parameters_say) {
  BaseClient& base = BaseClient::fresh();
  expect_at(base.truth, 2, 1, M_PI / 2, 1e-15);
  expect_at(base.odometry, 0, 0, 0, 0);
  for (int i = 0; i < kWheels; ++i) EXPECT_NEAR(base.joints.position[i], 0.1 * (i + 1), 1e-12);
}

TEST(SetState, puts_the_base_and_its_wheels_and_leaves_odometry) {
  BaseClient& base = BaseClient::fresh();
  base.command(twist(0.3, 0, 0));
  base.idle(300);
  base.command(twist(0, 0, 0));
  base.go_on(1000);
  const nav_msgs::Odometry before = base.odometry;
  nav_msgs::Odometry noted;
  ros::NodeHandle node;
  const ros::Subscriber subscriber =
      node.subscribe<nav_msgs::Odometry>(kStateSetTopic, 10, [&](const auto& message) { noted = *message; });
  wait_for("the node to be heard", [&] { return subscriber.getNumPublishers() == 1; });
  EXPECT_GT(before.pose.pose.position.x, 0.05);
  SetState::Request request;
  request.pose = pose(-3, 4, 0.5);
  request.wheel_angles = {1, 2, 3, 4};
  EXPECT_TRUE(set_state(request).success);
  base.go_on(1);
  wait_for("the note", [&] { return !noted.header.stamp.isZero(); });
  expect_at(noted, -3, 4, 0.5, 1e-15);
  EXPECT_EQ(noted.header.stamp + ros::Duration(0.001), base.truth.header.stamp);
  expect_at(base.truth, -3, 4, 0.5, 1e-7);  // a control period later
  for (int i = 0; i < kWheels; ++i) EXPECT_NEAR(base.joints.position[i], i + 1, 1e-6);
  expect_at(base.odometry, before.pose.pose.position.x, before.pose.pose.position.y,
            heading(before.pose.pose.orientation), 1e-6);

  // As gazebo's: pose and twist in the frame that is named. That of odometry began at the initial pose.
  request = {};
  request.reference_frame = "odom";
  request.pose = pose(1, 0, 0);
  request.twist.linear.x = 0.2;
  EXPECT_TRUE(set_state(request).success);
  base.go_on(1);
  expect_at(base.truth, 2, 2, M_PI / 2, 1e-3);
  EXPECT_NEAR(base.truth.twist.twist.linear.x, 0.2, 0.05);
  request.reference_frame = "world";
  request.pose = pose(0, 0, M_PI / 2);
  EXPECT_TRUE(set_state(request).success);
  base.go_on(1);
  EXPECT_NEAR(base.truth.twist.twist.linear.y, -0.2, 0.05) << "along x of the world";
}

TEST(SetState, refuses_what_no_base_has_and_says_why) {
  BaseClient& base = BaseClient::fresh();
  const auto expect_refused = [](const std::string& word, const std::function<void(SetState::Request&)>& spoil) {
    SetState::Request request;
    spoil(request);
    const SetState::Response response = set_state(request);
    EXPECT_FALSE(response.success) << word;
    EXPECT_NE(response.status_message.find(word), std::string::npos) << response.status_message;
  };
  expect_refused("pose.position.x = nan", [&](auto& request) { request.pose.position.x = kNan; });
  expect_refused("pose.position.z = 0.1", [](auto& request) { request.pose.position.z = 0.1; });
  expect_refused("pose.position.y = 10000000", [](auto& request) { request.pose.position.y = 1e7; });
  expect_refused("pose.orientation", [](auto& request) { request.pose.orientation.x = 1; });
  expect_refused("pose.orientation", [&](auto& request) { request.pose.orientation.w = kNan; });
  expect_refused("twist.linear.z, angular.x, angular.y = 0, 1, 0", [](auto& request) { request.twist.angular.x = 1; });
  expect_refused("twist.angular.z = -inf", [](auto& request) { request.twist.angular.z = -kInf; });
  expect_refused("reference_frame = map: must be world, odom or ~map_frame (plan)",
                 [](auto& request) { request.reference_frame = "map"; });
  expect_refused("wheel_angles: 3 numbers", [](auto& request) { request.wheel_angles = {1, 2, 3}; });
  expect_refused("wheel_angles[2] = nan", [&](auto& request) { request.wheel_angles = {1, 2, kNan, 4}; });
  base.go_on(2);
  expect_at(base.truth, 2, 1, M_PI / 2);
}

TEST(InitialPose, puts_the_base_where_rviz_says) {
  BaseClient& base = BaseClient::fresh();
  Log& log = Log::of(base);
  ros::NodeHandle node;
  ros::Publisher rviz = node.advertise<geometry_msgs::PoseWithCovarianceStamped>("initialpose", 10);
  wait_for("the node to listen", [&] { return rviz.getNumSubscribers() == 1; });
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header.frame_id = "map";
  message.pose.pose = pose(7, 7, 0);
  rviz.publish(message);
  message.header.frame_id = "plan";
  message.pose.pose = pose(-1, -2, 3);
  rviz.publish(message);
  for (int k = 0; k < 2000 && base.truth.pose.pose.position.x > 0; ++k) base.go_on(1);
  expect_at(base.truth, -1, -2, 3, 1e-6);
  log.expect(rosgraph_msgs::Log::WARN, {"header.frame_id = map", "rejected"});
}

}  // namespace
}  // namespace youbot_base_sim

int main(int argc, char** argv) { return youbot_base_sim::run_rostest(argc, argv); }
