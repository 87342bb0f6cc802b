// Bags as recorders write them, read back: units, signs, times, gaps, and files that are not what they should be.

#include "youbot_base_sim/identify/bag_reader.h"

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/JointState.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>

#include "program.h"
#include "youbot_base_sim/identify/ground_truth.h"
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

/// How a tracking system publishes a marker.
enum class Tracker { kNone, kPose, kPoseWithCovariance, kTransform, kTransforms };
const Eigen::Vector3d kMarker(0.12, -0.07, 0.5), kFrame(2, -1, 2.5);  // on the base, and its frame: m, m, rad
constexpr double kClock = 0.137;                                      // s, that its stamps are early

/// What the recorder gets.
struct Recording {
  bool effort = true, odometry = true, ground_truth = false, stamps = true, arm = false, rates = true;
  Tracker tracker = Tracker::kNone;
  double unseen_from = -1, unseen_to = -1;  // s, without poses of the marker
  double tilt = 0;                          // rad, of the marker
  double ticks = 0;                         // for a turn; 0: rad
  const char* joint_names[kWheels] = {};    // other names, of which those on the left turn backward
  bool driver_signs = false;                // velocities and efforts of the left wheels, as the driver publishes them
  double gap_from = -1, gap_to = -1;        // s, without joint states
  std::string joints = "/joint_states";     // topic
};

ros::Time at(double t) { return ros::Time(kWallTime + std::floor(t)) + ros::Duration(t - std::floor(t)); }

/// A pose in `frame`, in the frame around it.
Eigen::Vector3d placed(const Eigen::Vector3d& frame, const Eigen::Vector3d& pose) {
  const double c = std::cos(frame[2]), s = std::sin(frame[2]);
  return frame + Eigen::Vector3d(c * pose[0] - s * pose[1], s * pose[0] + c * pose[1], pose[2]);
}

geometry_msgs::TransformStamped link(const char* parent, const char* child, const Eigen::Vector3d& pose, double tilt,
                                     const ros::Time& stamp) {
  geometry_msgs::TransformStamped link;
  link.header.stamp = stamp;
  link.header.frame_id = parent;
  link.child_frame_id = child;
  link.transform.translation.x = pose[0];
  link.transform.translation.y = pose[1];
  link.transform.rotation.x = std::sin(tilt / 2) * std::cos(pose[2] / 2);
  link.transform.rotation.y = std::sin(tilt / 2) * std::sin(pose[2] / 2);
  link.transform.rotation.z = std::cos(tilt / 2) * std::sin(pose[2] / 2);
  link.transform.rotation.w = std::cos(tilt / 2) * std::cos(pose[2] / 2);
  return link;
}

template <class Pose>
void set(Pose& pose, const geometry_msgs::Transform& transform) {
  pose.position.x = transform.translation.x;
  pose.position.y = transform.translation.y;
  pose.orientation = transform.rotation;
}

void write_marker(rosbag::Bag& bag, const Recording& recording, const Eigen::Vector3d& base, double t) {
  const auto seen = link("mocap", "body", placed(kFrame, placed(base, kMarker)), recording.tilt, at(t - kClock));
  geometry_msgs::PoseStamped pose;
  geometry_msgs::PoseWithCovarianceStamped uncertain;
  tf2_msgs::TFMessage transforms;
  uncertain.header = pose.header = seen.header;
  set(pose.pose, seen.transform);
  set(uncertain.pose.pose, seen.transform);
  transforms.transforms.push_back(seen);
  if (recording.tracker == Tracker::kPose) bag.write("/mocap/base/pose", at(t + kArrival), pose);
  if (recording.tracker == Tracker::kPoseWithCovariance) bag.write("/mocap/base/pose", at(t + kArrival), uncertain);
  if (recording.tracker == Tracker::kTransform) bag.write("/mocap/base/pose", at(t + kArrival), seen);
  if (recording.tracker == Tracker::kTransforms) bag.write("/tf", at(t + kArrival), transforms);
}

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
    if (t < recording.unseen_from || t >= recording.unseen_to) write_marker(bag, recording, pose, t);
    const double middle = pose[2] + v[2] / kRate / 2;
    pose += Eigen::Vector3d(std::cos(middle) * v[0] - std::sin(middle) * v[1],
                            std::sin(middle) * v[0] + std::cos(middle) * v[1], v[2]) /
            kRate;
    sensor_msgs::JointState joints;
    if (recording.stamps) joints.header.stamp = at(t);
    for (const int i : {2, 0, 3, 1}) {
      const double sign = recording.driver_signs && i % 2 == 0 ? -1 : 1;
      const char* name = recording.joint_names[i];
      const double unit = (recording.ticks > 0 ? recording.ticks / 2 / M_PI : 1) * (name && i % 2 == 0 ? -1 : 1);
      joints.name.push_back(name ? name : wheel_joint(i));
      joints.position.push_back(unit * phi[i]);
      if (recording.rates) joints.velocity.push_back(sign * rates[i]);
      if (recording.effort) joints.effort.push_back(sign * std::copysign(0.3, rates[i]));
    }
    if (t < recording.gap_from || t >= recording.gap_to) bag.write(recording.joints, at(t + kArrival), joints);
    if (recording.arm) {
      joints.name = {"arm_joint_1"};
      joints.position = joints.velocity = joints.effort = {1};
      bag.write(recording.joints, at(t + kArrival), joints);
    }
    if (recording.odometry) bag.write("/odom", at(t + kArrival), odometry_message("odom", pose, v, at(t)));
    phi += rates / kRate;
    if (recording.ground_truth) {
      bag.write("/mocap/ground_truth", at(t + kArrival), odometry_message("world", pose, v, at(t)));
    }
  }
}

class BagReaderTest : public testing::Test {
 protected:
  DriveRecord read(const Recording& recording, const BagNames& names = {}) {
    write_bag(folder_.path("x.bag"), recording);
    return read_drive_bag(folder_.path("x.bag"), names);
  }

  void expect_refused(const std::string& file, const std::string& words, const BagNames& names = {}) {
    try {
      read_drive_bag(folder_.path(file), names);
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
TEST_F(BagReaderTest, FindsSamplesAndMotionsByTime) {
  DriveRecord record = read({});
  record.excluded.emplace_back(1.09, 1.19);
  const std::vector<std::size_t> samples = record.samples(record.t[50], record.t[100]);
  EXPECT_EQ(samples.front(), 50u);
  EXPECT_EQ(samples.back(), 99u);
  EXPECT_EQ(samples.size(), 45u);
  EXPECT_TRUE(record.samples(2, 1).empty());
  EXPECT_EQ(record.samples().size(), record.t.size() - 5);
  const std::vector<Motion> motions = record.motions();
  ASSERT_GE(motions.size(), 3u);
  EXPECT_EQ(&motion_at(motions, -1), &motions.front());
  EXPECT_EQ(&motion_at(motions, motions[1].begin), &motions[1]);
  EXPECT_EQ(&motion_at(motions, std::nextafter(motions[1].begin, 0)), &motions[0]);
  EXPECT_EQ(&motion_at(motions, 1e9), &motions.back());
}

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

RobotParameters base_of_the_bags() {
  RobotParameters robot;
  robot.R = kLengths.wheel_radius;
  robot.l = kLengths.half_lengths - robot.h;
  return robot;
}

/// The base's own poses over half a second, in its own frame.
void expect_moves_of_the_base(const DriveRecord& record) {
  for (std::size_t k = 50; k + 25 < record.truth.size(); k += 25) {
    const double t = record.truth_t[k] + 0.25;
    if (std::abs(t - std::round(t)) < 0.26) continue;  // the velocity changes
    const Eigen::Vector3d& v = kVelocities[static_cast<std::size_t>(t)];
    const Eigen::Vector3d step = record.truth[k + 5] - record.truth[k];
    const double span = record.truth_t[k + 5] - record.truth_t[k], heading = record.truth[k][2] + v[2] * span / 2;
    EXPECT_NEAR(std::cos(heading) * step[0] + std::sin(heading) * step[1], v[0] * span, 1e-4) << t;
    EXPECT_NEAR(std::cos(heading) * step[1] - std::sin(heading) * step[0], v[1] * span, 1e-4) << t;
    EXPECT_NEAR(step[2], v[2] * span, 1e-4) << t;
  }
}

// A marker at an unknown place on the base, in an unknown frame and with a clock of its own.
TEST_F(BagReaderTest, MovesTheGroundTruthOfAMarkerOntoTheBase) {
  for (const Tracker tracker :
       {Tracker::kPose, Tracker::kPoseWithCovariance, Tracker::kTransform, Tracker::kTransforms}) {
    Recording recording;
    recording.tracker = tracker;
    recording.unseen_from = 6.2;
    recording.unseen_to = 6.7;
    BagNames names;
    if (tracker == Tracker::kTransforms) names = {{}, Wheels::Ones(), "", {"mocap", "/body"}, true};
    DriveRecord record = read(recording, names);
    ASSERT_EQ(record.truth.size(), kRate * kVelocities.size() - 25);
    EXPECT_TRUE(record.truth_of_marker);
    EXPECT_TRUE(record.truth[0].head<2>().isApprox(placed(kFrame, placed({0, 0, 3}, kMarker)).head<2>()));
    const double before = record.truth_t[10];
    inspect(record);
    const std::vector<std::string> findings = prepare_ground_truth(record, base_of_the_bags());
    ASSERT_EQ(findings.size(), 2u) << findings.back();
    EXPECT_NE(findings[0].find("x.bag: a gap in ground truth of 0.52 s"), std::string::npos) << findings[0];
    EXPECT_NE(findings[1].find("of a marker at X = 0.1"), std::string::npos) << findings[1];
    EXPECT_NEAR(record.truth_t[10] - before, kClock, 5e-3);
    EXPECT_TRUE(record.is_tracked(6.1) && record.is_tracked(6.8));
    EXPECT_FALSE(record.is_tracked(6.4) || record.is_tracked(-0.5) || record.is_tracked(20));
    expect_moves_of_the_base(record);
  }
}

TEST_F(BagReaderTest, LeavesOutGroundTruthWhoseOffsetsCannotBeDetermined) {
  Recording recording;
  recording.tracker = Tracker::kPose;
  recording.gap_from = 0.5;  // the wheels' motion is not known
  recording.gap_to = 8.4;
  DriveRecord record = read(recording);
  const std::vector<std::string> findings = prepare_ground_truth(record, base_of_the_bags());
  EXPECT_NE(findings.back().find("ground truth is not used: its "), std::string::npos) << findings.back();
  EXPECT_FALSE(record.has_truth());
}

TEST_F(BagReaderTest, RefusesGroundTruthThatIsNotClear) {
  Recording recording;
  recording.tracker = Tracker::kPose;
  recording.tilt = M_PI / 2;
  write_bag(folder_.path("tilted.bag"), recording);
  expect_refused("tilted.bag", "the z axis of ground truth is not vertical");
  recording.tilt = 0;
  write_bag(folder_.path("two.bag"), recording);
  rosbag::Bag(folder_.path("two.bag"), rosbag::bagmode::Append)
      .write("/mocap/other/pose", at(1), geometry_msgs::PoseStamped());
  expect_refused("two.bag", "ground truth on /mocap/base/pose and /mocap/other/pose: choose one");
  BagNames names;
  names.truth_topic = "/mocap/base/pose";
  EXPECT_TRUE(read_drive_bag(folder_.path("two.bag"), names).has_truth());
  names.truth_topic = "/odometry";
  expect_refused("two.bag", "--truth-topic /odometry: must be a topic of nav_msgs/Odometry", names);
  names = {{}, Wheels::Ones(), "", {"mocap", "body"}, {}};
  expect_refused("two.bag", "no transforms from mocap to body", names);
}

TEST_F(BagReaderTest, RefusesABaseThatWasPutElsewhere) {
  const auto put_at = [&](double t) {
    write_bag(folder_.path("put.bag"), {});
    rosbag::Bag(folder_.path("put.bag"), rosbag::bagmode::Append)
        .write("/robot/state_set", at(t), odometry_message("world", {1, 2, 3}, {0, 0, 0}, at(t)));
  };
  put_at(3.5);
  expect_refused("put.bag", "the base was put elsewhere at t = 3.500 s, by /robot/state_set: must be one drive");
  put_at(-1);
  EXPECT_FALSE(read_drive_bag(folder_.path("put.bag")).t.empty());
}

// A tracker's link, a fixed one to the base, and in between what tf2 would not take.
TEST_F(BagReaderTest, LeavesOutTransformsThatAreNone) {
  Recording recording;
  recording.tracker = Tracker::kTransforms;
  const BagNames names{{}, Wheels::Ones(), "", {"mocap", "base"}, {}};
  const auto write = [&](const std::vector<geometry_msgs::TransformStamped>& fixed,
                         const std::vector<geometry_msgs::TransformStamped>& moving = {}) {
    write_bag(folder_.path("chain.bag"), recording);
    rosbag::Bag bag(folder_.path("chain.bag"), rosbag::bagmode::Append);
    tf2_msgs::TFMessage transforms;
    transforms.transforms = fixed;
    bag.write("/tf_static", at(0.5), transforms);
    transforms.transforms = moving;
    bag.write("/tf", at(4.5), transforms);
  };
  const auto whole = link("/body", "/base", {0.1, 0, 0}, 0, at(0));
  auto unturned = link("body", "base", {0.1, 0, 0}, 0, at(0)), lost = link("mocap", "body", {9, 9, 0}, 0, at(4.4955));
  auto infinite = lost;
  unturned.transform.rotation = lost.transform.rotation = geometry_msgs::Quaternion();  // all zero
  infinite.transform.translation.x = HUGE_VAL;
  write({whole});
  const std::vector<Eigen::Vector3d> expected = read_drive_bag(folder_.path("chain.bag"), names).truth;
  ASSERT_EQ(expected.size(), static_cast<std::size_t>(kRate) * kVelocities.size());
  write({whole, link("", "base", {9, 0, 0}, 0, at(0)), link("body", "", {9, 0, 0}, 0, at(0)),
         link("/", "/", {9, 0, 0}, 0, at(0)), unturned},
        {lost, infinite});
  EXPECT_EQ(read_drive_bag(folder_.path("chain.bag"), names).truth, expected);
  write({unturned, link("", "base", {9, 0, 0}, 0, at(0))});
  expect_refused("chain.bag", "no transforms from mocap to base: 2 are left out, which lack a frame's name, a finite",
                 names);
  write({whole}, {link("body", "base", {0.2, 0, 0}, 0, at(4.5))});
  expect_refused("chain.bag", "two links from mocap to base move; must be one", names);
  write({link("base", "plate", {0, 0, 0}, 0, at(0)), link("plate", "base", {0, 0, 0}, 0, at(0))});
  expect_refused("chain.bag", "no transforms from mocap to base", names);
}

// Sizes as odometry has them, and without it as ground truth shows them.
TEST_F(BagReaderTest, RefusesABaseOfOtherSizes) {
  RobotParameters larger = base_of_the_bags();
  larger.R *= 1.5;
  for (const bool odometry : {true, false}) {
    Recording recording;
    recording.odometry = odometry;
    recording.ground_truth = true;
    DriveRecord record = read(recording);
    inspect(record);
    EXPECT_TRUE(prepare_ground_truth(record, base_of_the_bags()).empty());
    try {
      prepare_ground_truth(record, larger);
      FAIL();
    } catch (const UnusableRecord& error) {
      const std::string words = odometry
                                    ? "x.bag: its odometry has a wheel radius of 0.052 m, where the scene has 0.078 m"
                                    : "x.bag: forward the base moves 0.67 times as far as wheels of the scene's sizes";
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }
}

TEST_F(BagReaderTest, ReadsEncodersOfOtherBases) {
  Recording recording;
  recording.rates = recording.effort = false;
  recording.ticks = 1440;
  const std::array<std::string, kWheels> names = {"front_left", "front_right", "rear_left", "rear_right"};
  for (int i = 0; i < kWheels; ++i) recording.joint_names[i] = names[i].c_str();
  const double unit = 2 * M_PI / recording.ticks;
  DriveRecord record = read(recording, {names, {-unit, unit, -unit, unit}, "", {}, {}});
  ASSERT_EQ(record.t.size(), kRate * kVelocities.size());
  EXPECT_TRUE(record.phi.front().isApprox(Wheels(100, 200, 300, 400)));
  EXPECT_TRUE(record.dphi[4 * 50 + 10].isApprox(kLengths.wheel_rates(kVelocities[4]), 1e-4));
  const std::vector<std::string> findings = inspect(record);
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_NE(findings[0].find("no velocities in joint_states: differences of the positions"), std::string::npos);
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
