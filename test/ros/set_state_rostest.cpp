// ~set_state and initialpose put the base elsewhere, exactly; what they cannot take is refused and changes nothing.

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <youbot_base_sim/SetState.h>

#include <limits>

#include "log.h"

namespace youbot_base_sim {
namespace {

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
  EXPECT_TRUE(ros::service::call("base_node/set_state", service));
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
  base.idle(1000);
  base.settle();
  const nav_msgs::Odometry before = base.odometry;
  nav_msgs::Odometry noted;
  ros::NodeHandle node;
  const ros::Subscriber subscriber =
      node.subscribe<nav_msgs::Odometry>(kStateSetTopic, 10, [&](const auto& message) { noted = *message; });
  base.wait_for("the node to be heard", [&] { return subscriber.getNumPublishers() == 1; });
  EXPECT_GT(before.pose.pose.position.x, 0.05);
  SetState::Request request;
  request.pose = pose(-3, 4, 0.5);
  request.wheel_angles = {1, 2, 3, 4};
  EXPECT_TRUE(set_state(request).success);
  base.idle(1);
  base.settle();
  base.wait_for("the note", [&] { return !noted.header.stamp.isZero(); });
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
  base.idle(1);
  base.settle();
  expect_at(base.truth, 2, 2, M_PI / 2, 1e-3);
  EXPECT_NEAR(base.truth.twist.twist.linear.x, 0.2, 0.05);
  request.reference_frame = "world";
  request.pose = pose(0, 0, M_PI / 2);
  EXPECT_TRUE(set_state(request).success);
  base.idle(1);
  base.settle();
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
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  expect_refused("pose.position.x = nan", [&](auto& request) { request.pose.position.x = kNan; });
  expect_refused("pose.position.z = 0.1", [](auto& request) { request.pose.position.z = 0.1; });
  expect_refused("pose.position.y = 10000000", [](auto& request) { request.pose.position.y = 1e7; });
  expect_refused("pose.orientation", [](auto& request) { request.pose.orientation.x = 1; });
  expect_refused("pose.orientation", [&](auto& request) { request.pose.orientation.w = kNan; });
  expect_refused("twist.linear.z, angular.x, angular.y = 0, 1, 0", [](auto& request) { request.twist.angular.x = 1; });
  expect_refused("twist.angular.z = -inf",
                 [](auto& request) { request.twist.angular.z = -std::numeric_limits<double>::infinity(); });
  expect_refused("reference_frame = map: must be world or odom",
                 [](auto& request) { request.reference_frame = "map"; });
  expect_refused("wheel_angles: 3 numbers", [](auto& request) { request.wheel_angles = {1, 2, 3}; });
  expect_refused("wheel_angles[2] = nan", [&](auto& request) { request.wheel_angles = {1, 2, kNan, 4}; });
  base.idle(2);
  base.settle();
  expect_at(base.truth, 2, 1, M_PI / 2);
}

TEST(InitialPose, puts_the_base_where_rviz_says) {
  BaseClient& base = BaseClient::fresh();
  Log& log = Log::of(base);
  ros::NodeHandle node;
  ros::Publisher rviz = node.advertise<geometry_msgs::PoseWithCovarianceStamped>("initialpose", 10);
  base.wait_for("the node to listen", [&] { return rviz.getNumSubscribers() == 1; });
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header.frame_id = "map";
  message.pose.pose = pose(7, 7, 0);
  rviz.publish(message);
  message.header.frame_id = "world";
  message.pose.pose = pose(-1, -2, 3);
  rviz.publish(message);
  for (int k = 0; k < 2000 && base.truth.pose.pose.position.x > 0; ++k) base.idle(1);
  base.settle();
  expect_at(base.truth, -1, -2, 3, 1e-6);
  log.expect(base, rosgraph_msgs::Log::WARN, {"header.frame_id = map", "rejected"});
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
