// slip_odometry by its topics: names, signs and ticks of another base; slip_odom, its frame and transform; reset.

#include <diagnostic_msgs/DiagnosticArray.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/JointState.h>
#include <std_srvs/Trigger.h>
#include <tf2_msgs/TFMessage.h>

#include <cmath>

#include "errors.h"
#include "program.h"
#include "ros/rostest.h"

namespace youbot_base_sim {
namespace {

class SlipOdometryNode : public testing::Test {
 protected:
  SlipOdometryNode() {
    wait_for("the node", [this] { return joints_.getNumSubscribers() == 1 && odometry_.getNumPublishers() == 1; });
  }

  /// Wheel angles of a base that drives forward at 0.314 m/s, t s after its start, in ticks of a thousand a turn.
  void publish(double t, double effort = 0) {
    sensor_msgs::JointState message;
    message.header.stamp = ros::Time(100 + t);
    const double ticks = std::round(1000 * t);
    message.name = {"d", "arm", "b", "a", "c"};
    message.position = {ticks, 1e9, ticks, -ticks, -ticks};
    message.effort = {effort, 0, effort, -effort, -effort};
    joints_.publish(message);
  }
  void drive(double from, double to) {
    for (double t = from; t < to; t += 0.02) {
      publish(t);
      wait_for("odometry", [&] { return last_ && last_->header.stamp >= ros::Time(100 + t); });
    }
  }

  ros::NodeHandle node_;
  ros::Publisher joints_ = node_.advertise<sensor_msgs::JointState>("/joint_states", 100);
  nav_msgs::Odometry::ConstPtr last_;
  tf2_msgs::TFMessage::ConstPtr transform_;
  ros::Subscriber odometry_ = node_.subscribe<nav_msgs::Odometry>(
      "/slip_odom", 100, [this](const nav_msgs::Odometry::ConstPtr& message) { last_ = message; });
  ros::Subscriber transforms_ = node_.subscribe<tf2_msgs::TFMessage>(
      "/tf", 100, [this](const tf2_msgs::TFMessage::ConstPtr& message) { transform_ = message; });
};

TEST_F(SlipOdometryNode, follows_the_wheels_of_another_base) {
  drive(0, 3);
  EXPECT_NEAR(last_->pose.pose.position.x, 0.314 * 2.98, 0.02);  // 2 pi 0.05 m a second
  EXPECT_NEAR(last_->pose.pose.position.y, 0, 0.01);
  EXPECT_NEAR(last_->twist.twist.linear.x, 0.314, 0.01);
  EXPECT_EQ(last_->header.frame_id, "slip");
  EXPECT_EQ(last_->child_frame_id, "base_footprint");
  EXPECT_GT(last_->pose.covariance[0], 1e-6);
  EXPECT_LT(last_->pose.covariance[0], 1e-2);
  wait_for("its transform",
           [this] { return transform_ && transform_->transforms[0].header.stamp == last_->header.stamp; });
  EXPECT_EQ(transform_->transforms[0].transform.translation.x, last_->pose.pose.position.x);
}

TEST_F(SlipOdometryNode, resets_and_says_so) {
  drive(4, 5);
  std_srvs::Trigger service;
  ASSERT_TRUE(call_service("/slip_odometry/reset", service));
  EXPECT_TRUE(service.response.success);
  publish(5.02);
  wait_for("odometry", [&] { return last_->header.stamp >= ros::Time(105.02); });
  EXPECT_NEAR(last_->pose.pose.position.x, 0, 0.01);
}

TEST_F(SlipOdometryNode, reports_what_it_cannot_know) {
  std::string reported;
  const ros::Subscriber diagnostics = node_.subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 100, [&](const diagnostic_msgs::DiagnosticArray::ConstPtr& message) {
        for (const auto& status : message->status) reported += status.message + "\n";
      });
  wait_for("its diagnostics", [&] { return diagnostics.getNumPublishers() == 1; });
  drive(6, 6.1);
  const std::string warning = "readings do not tell where the base is: no reading for ";
  double t = 8;  // two seconds later
  for (; t < 600 && reported.find(warning) == std::string::npos; t += 0.02) drive(t, t + 0.01);
  EXPECT_LT(t, 600) << reported;
  EXPECT_TRUE(std::isfinite(last_->pose.pose.position.x));
}

/// Expects that the program refuses one more parameter, in a line with these words.
void expect_refused(const std::string& parameter, const std::vector<std::string>& words) {
  static int number = 0;  // of a name of its own, so that it finds no parameters of another run
  Program process(SLIP_ODOMETRY, {parameter, "__name:=refused_" + std::to_string(++number)});
  EXPECT_EQ(process.wait(), 2);
  expect_words(process.out() + process.err(), words);
}

TEST(RefusedParameters, of_slip_odometry) {
  const TemporaryFolder folder;
  expect_refused("_profile:=real", {"parameter ~profile = real: must be paper, measured, measured_a or measured_b"});
  expect_refused("_friction_scale:=-9", {"parameter ~friction_scale = -9: must be"});
  expect_refused("_scene:=/nowhere/scene.yaml", {"parameter ~scene: ", "/nowhere/scene.yaml"});
  const std::string ideal = folder.write("ideal.yaml", "model: no_slip\n");
  expect_refused("_scene:=" + ideal, {"~scene", "no_slip", "must be one with slip"});
  expect_refused("_replicas:=1.5", {"~replicas", "1.5", "a whole number"});
  expect_refused("_joints:=a a a a", {"~joints", "a a a a", "four different joints"});
  expect_refused("_joint_signs:=1 1 -1", {"~joint_signs", "1 1 -1", "four words"});
  expect_refused("_replica:=2", {"~replica", "unknown", "replicas"});
}

TEST(RefusedParameters, are_listed_by_help) {
  Program process(SLIP_ODOMETRY, {"--help"});
  EXPECT_EQ(process.wait(), 0) << process.err();
  expect_words(process.out(), {"~scene", "~joints", "wheel_joint_fl", "~ticks_per_turn", "30 rad/s", "~reset"});
}

}  // namespace
}  // namespace youbot_base_sim

int main(int argc, char** argv) { return youbot_base_sim::run_rostest(argc, argv); }
