// launch/two_robots.launch: two bases in one world, each with its own commands, by one clock, with one tree of frames.

#include <geometry_msgs/Twist.h>
#include <nav_msgs/Odometry.h>
#include <rosgraph_msgs/Clock.h>
#include <visualization_msgs/MarkerArray.h>
#include <youbot_base_sim/ContactsStamped.h>
#include <youbot_base_sim/RollerSwitchStamped.h>

#include "base_process.h"
#include "frame_tree.h"
#include "rostest_main.h"

namespace youbot_base_sim {
namespace {

/// What is heard of one robot, whose namespace is its frames' prefix.
class Robot {
 public:
  explicit Robot(const std::string& name) : name_(name), node_("/" + name) {
    const auto keep = [this](const auto& message) { frames_.insert(message->header.frame_id); };
    subscribers_ = {node_.subscribe<nav_msgs::Odometry>("ground_truth", 10, [this](const auto& m) { truth = *m; }),
                    node_.subscribe<nav_msgs::Odometry>("odom", 10, [this](const auto& m) { odometry = *m; }),
                    node_.subscribe<ContactsStamped>("contacts", 10, keep),
                    node_.subscribe<RollerSwitchStamped>("base/roller_switches", 10, keep),
                    node_.subscribe<visualization_msgs::MarkerArray>("contact_markers", 10, [this](const auto& m) {
                      for (const auto& marker : m->markers) frames_.insert(marker.header.frame_id);
                    })};
    wait_for("the robot to listen and speak", [this] {
      return commands_.getNumSubscribers() == 1 && !truth.header.stamp.isZero() && !odometry.header.stamp.isZero();
    });
  }

  /// Commands for so much simulated time, s.
  void drive(double v_x, double duration) {
    geometry_msgs::Twist twist;
    twist.linear.x = v_x;
    commands_.publish(twist);
    const ros::Time end = odometry.header.stamp + ros::Duration(duration);
    wait_for("time to pass", [&] { return odometry.header.stamp >= end; });
  }

  void expect_own_frames() const {
    EXPECT_EQ(odometry.header.frame_id, name_ + "/odom");
    EXPECT_EQ(odometry.child_frame_id, name_ + "/base_footprint");
    EXPECT_EQ(truth.header.frame_id, "world");
    EXPECT_EQ(truth.child_frame_id, name_ + "/base_footprint");
    EXPECT_GE(frames_.size(), 2u);
    for (const std::string& frame : frames_) EXPECT_EQ(frame.rfind(name_ + "/", 0), 0u) << frame;
  }

  nav_msgs::Odometry odometry, truth;

 private:
  std::string name_;
  ros::NodeHandle node_;
  std::set<std::string> frames_;
  std::vector<ros::Subscriber> subscribers_;
  ros::Publisher commands_ = node_.advertise<geometry_msgs::Twist>("cmd_vel", 10);
};

TEST(TwoRobots, drive_alone_by_one_clock_in_one_tree) {
  FrameTree frames;
  frames.listen();
  Robot first("youbot_1"), second("youbot_2");
  second.drive(0.3, 1);
  EXPECT_GT(second.truth.pose.pose.position.x, 0.2);
  EXPECT_NEAR(second.truth.pose.pose.position.y, -0.5, 0.01);
  EXPECT_EQ(first.truth.pose.pose.position.x, 0) << "is not commanded";
  EXPECT_EQ(first.truth.pose.pose.position.y, 0.5);

  const double before = second.truth.pose.pose.position.x;
  second.drive(0, 0.5);
  first.drive(0.3, 1);
  EXPECT_GT(first.truth.pose.pose.position.x, 0.2);
  EXPECT_LT(second.truth.pose.pose.position.x, before + 0.3 * 0.5);
  EXPECT_LE(std::abs((first.odometry.header.stamp - second.odometry.header.stamp).toSec()), 0.1) << "one clock";

  for (const Robot* robot : {&first, &second}) robot->expect_own_frames();
  for (const std::string name : {"youbot_1/", "youbot_2/"}) {
    for (const std::string pose : {"", "ground_truth/"}) {
      wait_for("the wheels", [&] { return frames.has(name + pose + "wheel_link_br"); });
    }
  }
  frames.expect_whole("world");
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
