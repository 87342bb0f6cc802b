// mecanum_drive_controller on the simulated base: where it says that the base is, and where that is.

#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

namespace {

struct Pose {
  double x, y, psi;
};

double turned(const Pose& from, const Pose& to) { return std::remainder(to.psi - from.psi, 2 * M_PI); }

/// Motion from one pose to another, in the frame of the first.
Pose motion(const Pose& from, const Pose& to) {
  const double c = std::cos(from.psi), s = std::sin(from.psi), x = to.x - from.x, y = to.y - from.y;
  return {c * x + s * y, c * y - s * x, turned(from, to)};
}

class DriveTest : public testing::Test {
 protected:
  static constexpr double kOdometryPeriod = 0.02;  // s

  void SetUp() override {
    while (ros::ok() && (commands_.getNumSubscribers() == 0 || odometry_.empty() || truth_.empty())) spin(0.1);
  }

  void spin(double duration) {
    const ros::WallTime start = ros::WallTime::now();
    const ros::Time end = ros::Time::now() + ros::Duration(duration);
    while (ros::ok() && ros::Time::now() < end) {
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.001));
      ASSERT_LT((ros::WallTime::now() - start).toSec(), 60 + 20 * duration) << "simulated time stands still";
    }
  }

  /// Keeps commanding this velocity, and then none.
  void drive(double v_x, double v_y, double omega, double duration) {
    geometry_msgs::Twist command;
    command.linear.x = v_x;
    command.linear.y = v_y;
    command.angular.z = omega;
    for (double t = 0; t < duration; t += 0.1) {
      commands_.publish(command);
      spin(0.1);
    }
    commands_.publish(geometry_msgs::Twist());
    spin(1);
  }

  /// Both poses at the last instant that both topics have: on a busy machine one arrives after the other.
  std::pair<Pose, Pose> poses() const {
    for (auto last = odometry_.rbegin(); last != odometry_.rend(); ++last) {
      const auto truth = truth_.find(last->first);
      if (truth != truth_.end()) return {last->second, truth->second};
    }
    throw std::runtime_error("odometry and truth have no instant in common");
  }

  struct Outcome {
    Pose odometry, truth;
  };

  Outcome outcome(double v_x, double v_y, double omega, double duration) {
    spin(1);
    const auto before = poses();
    drive(v_x, v_y, omega, duration);
    const auto after = poses();
    const Outcome result = {motion(before.first, after.first), motion(before.second, after.second)};
    std::printf(
        "(%.1f m/s, %.1f m/s, %.1f rad/s) for %.0f s: odometry %.4f m, %.4f m, %.4f rad; base %.4f m, %.4f m, %.4f "
        "rad\n",
        v_x, v_y, omega, duration, result.odometry.x, result.odometry.y, result.odometry.psi, result.truth.x,
        result.truth.y, result.truth.psi);
    return result;
  }

  static void keep(std::map<ros::Time, Pose>& poses, const nav_msgs::Odometry& message) {
    const auto& pose = message.pose.pose;
    poses[message.header.stamp] = {pose.position.x, pose.position.y,
                                   2 * std::atan2(pose.orientation.z, pose.orientation.w)};
  }

  std::map<ros::Time, Pose> odometry_, truth_;
  ros::NodeHandle node_;
  ros::Publisher commands_ = node_.advertise<geometry_msgs::Twist>("/mecanum_drive/cmd_vel", 1);
  ros::Subscriber odometry_subscriber_ = node_.subscribe<nav_msgs::Odometry>(
      "/mecanum_drive/odomTopic", 1000, [this](const nav_msgs::OdometryConstPtr& m) { keep(odometry_, *m); });
  ros::Subscriber truth_subscriber_ = node_.subscribe<nav_msgs::Odometry>(
      "/ground_truth", 1000, [this](const nav_msgs::OdometryConstPtr& m) { keep(truth_, *m); });
};

TEST_F(DriveTest, Ahead) {
  const Outcome found = outcome(0.3, 0, 0, 4);
  EXPECT_NEAR(found.odometry.x, 1.2, 0.05);
  EXPECT_NEAR(found.truth.x, found.odometry.x, 0.02 * found.truth.x);
  EXPECT_NEAR(found.truth.y, 0, 0.05);
}

TEST_F(DriveTest, Sideways) {
  const Outcome found = outcome(0, 0.3, 0, 4);
  EXPECT_NEAR(found.odometry.y, 1.2, 0.05);
  // The rollers' friction makes a real base lose a few per cent.
  EXPECT_LT(found.truth.y, 0.995 * found.odometry.y);
  EXPECT_GT(found.truth.y, 0.9 * found.odometry.y);
}

TEST_F(DriveTest, Turning) {
  const Outcome found = outcome(0, 0, 0.5, 4);
  EXPECT_NEAR(found.odometry.psi, 2, 0.08);
  EXPECT_NEAR(found.truth.psi, found.odometry.psi, 0.05 * found.truth.psi);
}

TEST_F(DriveTest, StopsWithoutCommands) {
  geometry_msgs::Twist command;
  command.linear.x = 0.3;
  commands_.publish(command);
  spin(2.5);
  const auto before = poses();
  spin(1);
  EXPECT_NEAR(motion(before.second, poses().second).x, 0, 0.005);
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "drive_test");
  return RUN_ALL_TESTS();
}
