// Bags as recorders write them, read back: units, signs, times, gaps, and files that are not what they should be.

#include "youbot_base_sim/identify/bag_reader.h"

#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/JointState.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>

#include "../program.h"
#include "youbot_base_sim/ros/conversions.h"

namespace youbot_base_sim {
namespace {

constexpr double kWallTime = 1.7e9;  // s, of a recorder's clock
constexpr double kRate = 50;         // Hz, of the driver
constexpr double kArrival = 2e-3;    // s, from a stamp to the recorder
const DriverKinematics kLengths{0.052, 0.4};

/// Velocities of the base, one a second.
const std::vector<Eigen::Vector3d> kVelocities = {{0, 0, 0},    {0.1, 0, 0},      {-0.2, 0, 0},
                                                  {0, 0.1, 0},  {0, 0, 0.4},      {0.1, 0.05, -0.2},
                                                  {0, -0.2, 0}, {0.05, 0, -0.05}, {0, 0, 0}};

/// What the recorder gets.
struct Recording {
  bool effort = true, odometry = true, ground_truth = false, stamps = true, arm = false;
  bool driver_signs = false;             // velocities and efforts of the left wheels, as the driver publishes them
  double gap_from = -1, gap_to = -1;     // s, without joint states
  std::string joints = "/joint_states";  // topic
};

ros::Time at(double t) { return ros::Time(kWallTime + std::floor(t)) + ros::Duration(t - std::floor(t)); }

/// Wheels that follow at once and need 0.3 N m, of a base that is where its odometry says.
void write_bag(const std::string& path, const Recording& recording) {
  rosbag::Bag bag(path, rosbag::bagmode::Write);
  for (std::size_t k = 0; k < kVelocities.size(); ++k) {
    geometry_msgs::Twist twist;
    twist.linear.x = kVelocities[k][0];
    twist.linear.y = kVelocities[k][1];
    twist.angular.z = kVelocities[k][2];
    bag.write("/cmd_vel", at(static_cast<double>(k) + 0.005), twist);
  }
  Wheels phi(100, 200, 300, 400);
  Eigen::Vector3d pose(0, 0, 3);  // the heading passes pi
  for (int k = 0; k < kRate * static_cast<double>(kVelocities.size()); ++k) {
    const double t = k / kRate;
    const Eigen::Vector3d& v = kVelocities[static_cast<std::size_t>(t)];
    const Wheels rates = kLengths.wheel_rates(v);
    phi += rates / kRate;
    pose[2] += v[2] / kRate;
    sensor_msgs::JointState joints;
    if (recording.stamps) joints.header.stamp = at(t);
    for (const int i : {2, 0, 3, 1}) {
      const double sign = recording.driver_signs && i % 2 == 0 ? -1 : 1;
      joints.name.push_back(wheel_joint(i));
      joints.position.push_back(phi[i]);
      joints.velocity.push_back(sign * rates[i]);
      if (recording.effort) joints.effort.push_back(sign * std::copysign(0.3, rates[i]));
    }
    if (t < recording.gap_from || t >= recording.gap_to) bag.write(recording.joints, at(t + kArrival), joints);
    if (recording.arm) {
      joints.name = {"arm_joint_1"};
      joints.position = joints.velocity = joints.effort = {1};
      bag.write(recording.joints, at(t + kArrival), joints);
    }
    if (recording.odometry) bag.write("/odom", at(t + kArrival), odometry_message("odom", pose, v, at(t)));
    if (recording.ground_truth) {
      bag.write("/mocap/ground_truth", at(t + kArrival), odometry_message("world", pose, v, at(t)));
    }
  }
}

class BagReaderTest : public testing::Test {
 protected:
  DriveRecord read(const Recording& recording) {
    write_bag(folder_.path("x.bag"), recording);
    return read_drive_bag(folder_.path("x.bag"));
  }

  void expect_refused(const std::string& file, const std::string& words) {
    try {
      read_drive_bag(folder_.path(file));
      FAIL() << words;
    } catch (const UnusableRecord& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(file), std::string::npos) << error.what();
    }
  }

  TemporaryFolder folder_;
};

TEST_F(BagReaderTest, HasTheWheelsInTheirOrderAndTimesFromTheFirstStamp) {
  const DriveRecord record = read({});
  ASSERT_EQ(record.t.size(), kRate * kVelocities.size());
  EXPECT_EQ(record.t.front(), 0);
  EXPECT_NEAR(record.t.back(), static_cast<double>(kVelocities.size()) - 1 / kRate, 1e-6);
  EXPECT_TRUE((record.phi.front() == Wheels(100, 200, 300, 400)).all());
  const std::size_t turning = 4 * 50 + 10;
  EXPECT_TRUE(record.dphi[turning].isApprox(kLengths.wheel_rates(kVelocities[4])));
  EXPECT_TRUE(record.torque[turning].isApprox(Wheels(-0.3, 0.3, -0.3, 0.3)));
  EXPECT_FALSE(record.has_truth());
}

// cmd_vel becomes rates by the lengths of the odometry, which are not the driver's usual ones here.
TEST_F(BagReaderTest, FindsTheLengthsByWhichTheDriverMakesRates) {
  for (const bool driver_signs : {false, true}) {
    Recording recording;
    recording.driver_signs = driver_signs;
    const DriveRecord record = read(recording);
    ASSERT_EQ(record.commands.t.size(), kVelocities.size());
    for (std::size_t k = 0; k < kVelocities.size(); ++k) {
      EXPECT_NEAR(record.commands.t[k], static_cast<double>(k) + 0.005, 1e-6);
      EXPECT_LT((record.commands.values[k] - kLengths.wheel_rates(kVelocities[k])).abs().maxCoeff(), 1e-6) << k;
    }
  }
  Recording recording;
  recording.odometry = false;
  const DriveRecord record = read(recording);
  EXPECT_TRUE(record.commands.values[5].isApprox(DriverKinematics().wheel_rates(kVelocities[5])));
}

TEST_F(BagReaderTest, IsMendedByInspection) {
  Recording recording;
  recording.driver_signs = true;
  recording.gap_from = 3.5;
  recording.gap_to = 4.2;
  DriveRecord record = read(recording);
  const std::vector<std::string> findings = inspect(record);
  const auto named = [&](const std::string& words) {
    return std::any_of(findings.begin(), findings.end(),
                       [&](const std::string& line) { return line.find(words) != std::string::npos; });
  };
  EXPECT_TRUE(named("x.bag: a gap in joint_states of 0.72 s at 3.48 s"));
  EXPECT_TRUE(named("the velocity of wheel fl has the sign opposite"));
  EXPECT_TRUE(named("the effort of wheel bl brakes it"));
  EXPECT_FALSE(named("wheel fr"));
  EXPECT_TRUE(record.is_excluded(4));
  EXPECT_TRUE((record.dphi[75] > 0).all() || (record.dphi[75] < 0).all()) << "straight ahead";
}

TEST_F(BagReaderTest, ReadsGroundTruthWithItsHeadingUnwrapped) {
  Recording recording;
  recording.ground_truth = true;
  const DriveRecord record = read(recording);
  ASSERT_EQ(record.truth.size(), record.t.size());
  EXPECT_NEAR(record.truth_t.back(), record.t.back(), 1e-6);
  EXPECT_NEAR(record.truth[5 * 50 - 1][2], 3.4, 1e-6);
}

TEST_F(BagReaderTest, UsesArrivalWhereNobodySetStamps) {
  Recording recording;
  recording.stamps = false;
  const DriveRecord record = read(recording);
  EXPECT_NEAR(record.t[1], 1 / kRate, 1e-6);
  EXPECT_NEAR(record.commands.t[1], 1.005 - kArrival, 1e-6);
}

TEST_F(BagReaderTest, TakesAnyNamespaceAndNoArm) {
  Recording recording;
  recording.joints = "/youbot/base/joint_states";
  recording.arm = true;
  EXPECT_EQ(read(recording).t.size(), kRate * kVelocities.size());
}

TEST_F(BagReaderTest, HasZerosForAMissingEffort) {
  Recording recording;
  recording.effort = false;
  DriveRecord record = read(recording);
  const std::vector<std::string> findings = inspect(record);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_NE(findings[0].find("no effort"), std::string::npos);
  EXPECT_FALSE(record.has_torque());
}

TEST_F(BagReaderTest, RefusesWrongFiles) {
  expect_refused("missing.bag", "is no file");
  folder_.write("text.bag", "t,fl,fr,bl,br\n0,1,1,1,1\n");
  expect_refused("text.bag", "cannot be read as a bag");
  std::ofstream(folder_.path("empty.bag"));
  expect_refused("empty.bag", "cannot be read as a bag");
  rosbag::Bag(folder_.path("other.bag"), rosbag::bagmode::Write).write("/cmd_vel", at(0), geometry_msgs::Twist());
  expect_refused("other.bag", "no joint_states");
}

// A recorder that was killed leaves a bag without its index, perhaps with half a chunk at its end.
TEST_F(BagReaderTest, RefusesATruncatedBagWithTheRemedy) {
  write_bag(folder_.path("cut.bag"), {});
  std::filesystem::resize_file(folder_.path("cut.bag"), std::filesystem::file_size(folder_.path("cut.bag")) / 2);
  expect_refused("cut.bag", "cannot be read as a bag");
}

// The program ends by a signal as simulate and sweep do, also amid a fit.
TEST_F(BagReaderTest, ASignalEndsIdentifyInALine) {
  write_bag(folder_.path("x.bag"), {});
  Program identify(IDENTIFY, {folder_.path("x.bag"), "--output", folder_.path("fitted.yaml")});
  const auto catches_it = [&] {
    std::ifstream status("/proc/" + std::to_string(identify.id()) + "/status");
    for (std::string name; status >> name;) {
      unsigned long long caught = 0;
      if (name == "SigCgt:") return static_cast<bool>(status >> std::hex >> caught) && (caught >> (SIGTERM - 1) & 1);
    }
    return false;
  };
  for (int tries = 0; !catches_it() && tries < 30000; ++tries)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  identify.send(SIGTERM);
  EXPECT_EQ(identify.wait(), 1);
  EXPECT_EQ(identify.err(), "identify: stopped by signal 15, Terminated\n");
  EXPECT_FALSE(folder_.has("fitted.yaml"));
}

}  // namespace
}  // namespace youbot_base_sim
