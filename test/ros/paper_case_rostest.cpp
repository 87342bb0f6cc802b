// The launch file plays a scene into the node and records it, then ends, its own master with it: the bag is complete.

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/JointState.h>
#include <tf2_msgs/TFMessage.h>

#include <map>

#include "free_port.h"
#include "program.h"
#include "rostest_main.h"
#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

constexpr char kScene[] = YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case1_as_printed.yaml";
constexpr double kDuration = 1.0;
constexpr int kInstants = 51;  // 0, 0.02, ..., 1

/// roslaunch of the launch file, with a bag at `bag`, where no master runs: with one, it would end by itself.
std::vector<std::string> launch(const std::string& bag, std::vector<std::string> arguments) {
  const std::string port = std::to_string(free_port());
  arguments.insert(arguments.begin(), {"ROS_MASTER_URI=http://localhost:" + port, "roslaunch", "-p", port,
                                       "youbot_base_sim", "paper_case.launch", "bag:=" + bag});
  return arguments;
}

// Neither waits for ever for the other, which never comes.
TEST(PaperCaseLaunch, ends_when_either_refuses) {
  const TemporaryFolder folder;
  const std::string no_drive = folder.write("no_drive.yaml", "duration: 1\n");
  const std::vector<std::vector<std::string>> cases = {
      {"scene:=" + no_drive, "drive is left out: there is nothing to play", "no command for 1 s at t = 0 s"},
      {"publish_rate:=-1", "parameter ~publish_rate = -1", "[play_scene-3] killing on exit"}};
  for (const auto& refused : cases) {
    Program roslaunch("/usr/bin/env", launch(folder.path("x.bag"), {"lockstep_timeout:=1", refused[0]}));
    EXPECT_EQ(roslaunch.wait(), 0) << roslaunch.out() << roslaunch.err();
    const std::string said = roslaunch.out() + roslaunch.err();
    EXPECT_NE(said.find(refused[1]), std::string::npos) << said;
    EXPECT_NE(said.find(refused[2]), std::string::npos) << said;
    EXPECT_FALSE(folder.has("x.bag"));
  }
}

class PaperCase : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const TemporaryFolder folder;
    const std::string path = folder.path("case.bag");
    Program roslaunch("/usr/bin/env", launch(path, {"duration:=" + std::to_string(kDuration),
                                                    std::string("scene:=") + kScene, "publish_contacts:=true"}));
    ASSERT_EQ(roslaunch.wait(), 0) << roslaunch.out() << roslaunch.err();
    const std::string said = roslaunch.out() + roslaunch.err();
    EXPECT_EQ(said.find("died!"), std::string::npos) << "an end that is meant looks like one: " << said;
    EXPECT_NE(said.find("the last publisher of commands has gone"), std::string::npos) << said;
    bag_.open(path, rosbag::bagmode::Read);
  }

  static void TearDownTestSuite() { bag_.close(); }

  template <class Message>
  static std::vector<boost::shared_ptr<Message>> read(const std::string& topic) {
    rosbag::View view(bag_, rosbag::TopicQuery(topic));
    std::vector<boost::shared_ptr<Message>> messages;
    for (const rosbag::MessageInstance& instance : view) messages.push_back(instance.instantiate<Message>());
    return messages;
  }

  static rosbag::Bag bag_;
};

rosbag::Bag PaperCase::bag_;

template <class Message>
void expect_every_instant(const std::vector<boost::shared_ptr<Message>>& messages) {
  ASSERT_EQ(messages.size(), static_cast<std::size_t>(kInstants));
  for (int k = 0; k < kInstants; ++k) EXPECT_EQ(messages[k]->header.stamp, stamp_of(0.02 * k));
}

TEST_F(PaperCase, has_every_topic_at_every_instant) {
  expect_every_instant(read<nav_msgs::Odometry>("/odom"));
  expect_every_instant(read<nav_msgs::Odometry>("/ground_truth"));
  expect_every_instant(read<sensor_msgs::JointState>("/base/joint_states"));
  expect_every_instant(read<ContactsStamped>("/contacts"));
  const auto transforms = read<tf2_msgs::TFMessage>("/tf");
  ASSERT_EQ(transforms.size(), static_cast<std::size_t>(kInstants));
  for (int k = 0; k < kInstants; ++k) EXPECT_EQ(transforms[k]->transforms.at(0).header.stamp, stamp_of(0.02 * k));
}

TEST_F(PaperCase, has_every_switch) {
  Scene scene = load_scene(kScene);
  scene.solver.control_period = 1e-3;
  Simulation simulation(scene);
  simulation.advance_to(kDuration);
  const std::vector<RollerSwitch> expected = simulation.take_switches();
  const auto published = read<RollerSwitchStamped>("/base/roller_switches");
  ASSERT_EQ(published.size(), expected.size());
  ASSERT_GT(published.size(), 10u);
  for (std::size_t k = 0; k < expected.size(); ++k) {
    EXPECT_NEAR(published[k]->t, expected[k].t, 1e-9);
    EXPECT_EQ(published[k]->wheel, wheel_joint(expected[k].wheel));
    EXPECT_GE(published[k]->header.stamp, published[k == 0 ? 0 : k - 1]->header.stamp);
  }
  const auto truth = read<nav_msgs::Odometry>("/ground_truth");
  EXPECT_NEAR(truth.back()->pose.pose.position.x, simulation.state().x(), 1e-9);
  EXPECT_NEAR(truth.back()->pose.pose.position.y, simulation.state().y(), 1e-9);
}

// In lockstep each control period has its own command, as offline it has its own sample of the drive. For the same
// torques the motion is the same to the last bit; the player's are those of the times that /clock tells, in ns.
TEST_F(PaperCase, has_the_bits_of_the_same_run_offline) {
  Scene scene = load_scene(kScene);
  scene.solver.control_period = 1e-3;
  const std::shared_ptr<TorqueProfile> torque = make_torque_profile(scene);
  torque->begin_segment(0);
  const auto player = [&](double t, const State&) { return torque->value(time_of(stamp_of(t))); };
  Simulation simulation(scene);
  const auto truth = read<nav_msgs::Odometry>("/ground_truth");
  ASSERT_EQ(truth.size(), static_cast<std::size_t>(kInstants));
  for (std::size_t k = 0; k < truth.size(); ++k) {
    advance_to(simulation, 0.02 * static_cast<double>(k), player);
    const State& x = simulation.state();
    EXPECT_EQ(truth[k]->pose.pose.position.x, x.x()) << "at " << simulation.time() << " s";
    EXPECT_EQ(truth[k]->pose.pose.position.y, x.y());
    EXPECT_EQ(truth[k]->twist.twist.linear.x, x.V_X());
    EXPECT_EQ(truth[k]->twist.twist.linear.y, x.V_Y());
    EXPECT_EQ(truth[k]->twist.twist.angular.z, x.Omega());
  }
  const auto published = read<RollerSwitchStamped>("/base/roller_switches");
  const std::vector<RollerSwitch> expected = simulation.take_switches();
  ASSERT_EQ(published.size(), expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k) {
    EXPECT_EQ(published[k]->t, expected[k].t);
    EXPECT_EQ(published[k]->phi, expected[k].phi);
  }
}

TEST_F(PaperCase, is_in_order) {
  std::map<std::string, ros::Time> last;
  rosbag::View view(bag_);
  for (const rosbag::MessageInstance& instance : view) {
    ros::Time& before = last[instance.getTopic()];
    EXPECT_GE(instance.getTime(), before) << instance.getTopic();
    EXPECT_LE(instance.getTime(), ros::Time(kDuration)) << "simulated time";
    before = instance.getTime();
  }
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
