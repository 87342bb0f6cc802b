// The node's bag has all that it publishes, in its own namespace, by another node's clock, and started by a launch
// file.

#include <geometry_msgs/Twist.h>
#include <geometry_msgs/WrenchStamped.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/JointState.h>
#include <tf2_msgs/TFMessage.h>
#include <youbot_base_sim/LoadsStamped.h>
#include <youbot_base_sim/SetLoads.h>
#include <youbot_base_sim/SetState.h>

#include <map>

#include "base_process.h"
#include "frame_tree.h"
#include "free_port.h"
#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

template <class Message>
std::vector<Message> read(const rosbag::Bag& bag, const std::string& topic) {
  std::vector<Message> messages;
  for (const rosbag::MessageInstance& instance : rosbag::View(bag, rosbag::TopicQuery(topic))) {
    messages.push_back(*instance.instantiate<Message>());
  }
  return messages;
}

// What comes by ~wrench, ~set_loads and ~set_state, under the names of the node's namespace.
TEST(LoadBag, has_what_pushed_the_base_and_what_it_carried) {
  const TemporaryFolder folder;
  BaseProcess base("pushed", {"_publish_clock:=true", "_tf_prefix:=robot", "_bag:=" + folder.path("x.bag")});
  base.expect_instants(2);
  ros::NodeHandle node;
  ros::Publisher pusher = node.advertise<geometry_msgs::WrenchStamped>("/pushed/base/wrench", 10);
  wait_for("the node to listen", [&] { return pusher.getNumSubscribers() == 1; });
  geometry_msgs::WrenchStamped push;
  push.wrench.force.y = 30;
  push.wrench.torque.z = 2;
  pusher.publish(push);
  SetLoads service;
  service.request.loads.resize(1);
  service.request.loads[0].mass = 7;
  service.request.loads[0].position.x = 0.1;
  ASSERT_TRUE(call_service("/pushed/base/set_loads", service) && service.response.success);
  service.request.loads[0].mass = -7;
  ASSERT_TRUE(call_service("/pushed/base/set_loads", service));
  ASSERT_FALSE(service.response.success);
  base.expect_simulated(0.1);
  service.request.loads.clear();
  ASSERT_TRUE(call_service("/pushed/base/set_loads", service) && service.response.success);
  base.expect_simulated(0.1);
  SetState state;
  state.request.pose.position.x = 4;
  ASSERT_TRUE(call_service("/pushed/base/set_state", state) && state.response.success);
  base.expect_simulated(0.1);
  Program reset("/usr/bin/env", {"rosservice", "call", "/pushed/base/reset"});
  EXPECT_NE(reset.wait(), 0);
  EXPECT_NE(reset.err().find("rejected while ~bag is written"), std::string::npos) << reset.err();
  base.interrupt();

  const rosbag::Bag bag(folder.path("x.bag"));
  const auto wrenches = read<geometry_msgs::WrenchStamped>(bag, "/pushed/applied_wrench");
  ASSERT_GT(wrenches.size(), 5u);  // at each instant
  EXPECT_EQ(wrenches.front().header.frame_id, "robot/base_link");
  EXPECT_EQ(wrenches.back().wrench.force.y, 30);
  EXPECT_EQ(wrenches.back().wrench.torque.z, 2);
  EXPECT_NEAR(wrenches.back().wrench.torque.x, 0, 1e-12) << "it acts at the origin of base_link";
  const auto loads = read<LoadsStamped>(bag, "/pushed/loads");
  ASSERT_EQ(loads.size(), 2u);
  ASSERT_EQ(loads[0].loads.size(), 1u);
  EXPECT_EQ(loads[0].loads[0].mass, 7);
  EXPECT_EQ(loads[0].loads[0].position.x, 0.1);
  EXPECT_NEAR(loads[0].loads[0].position.z, 0, 1e-12);
  EXPECT_TRUE(loads[1].loads.empty());
  EXPECT_GT(loads[1].header.stamp, loads[0].header.stamp);
  const auto states = read<nav_msgs::Odometry>(bag, "/pushed/state_set");
  ASSERT_EQ(states.size(), 1u);
  EXPECT_EQ(states[0].pose.pose.position.x, 4);
  EXPECT_GT(states[0].header.stamp, loads[1].header.stamp);
  const auto transforms = read<tf2_msgs::TFMessage>(bag, "/tf");
  ASSERT_FALSE(transforms.empty());
  EXPECT_EQ(transforms[0].transforms.at(0).child_frame_id, "robot/base_footprint");
}

/// Expects odometry of each fiftieth of a second up to `end`, topics and frames of its own, and x at the end. Adds its
/// frames.
void expect_complete(const rosbag::Bag& bag, const std::string& name, const ros::Time& end, double x,
                     FrameTree& frames) {
  const auto odometry = read<nav_msgs::Odometry>(bag, "/" + name + "/odom");
  ASSERT_GT(odometry.size(), 20u);
  for (std::size_t k = 1; k < odometry.size(); ++k)
    EXPECT_NEAR((odometry[k].header.stamp - odometry[k - 1].header.stamp).toSec(), 0.02, 1e-8);
  EXPECT_GE(odometry.back().header.stamp, end);
  EXPECT_EQ(odometry.back().header.frame_id, name + "/odom");
  EXPECT_NEAR(odometry.back().pose.pose.position.x, x, 0.1 * x) << name;
  EXPECT_EQ(read<nav_msgs::Odometry>(bag, "/" + name + "/ground_truth").size(), odometry.size());
  for (const rosbag::ConnectionInfo* topic : rosbag::View(bag).getConnections()) {
    EXPECT_TRUE(topic->topic.rfind("/" + name + "/", 0) == 0 || topic->topic.rfind("/tf", 0) == 0) << topic->topic;
  }
  for (const std::string topic : {"/tf", "/tf_static"}) {
    const auto messages = read<tf2_msgs::TFMessage>(bag, topic);
    EXPECT_EQ(messages.size(), topic == "/tf" ? odometry.size() : 1u);
    for (const tf2_msgs::TFMessage& message : messages) frames.add(message);
  }
}

TEST(LoadBag, two_robots_have_one_each_by_one_clock) {
  const TemporaryFolder folder;
  const SimulatedTime simulated_time;
  const auto parameters = [&](const std::string& name) {
    return std::vector<std::string>{"_tf_prefix:=" + name, "_world_tf:=true", "_bag:=" + folder.path(name)};
  };
  std::vector<std::string> master = parameters("one");
  master.insert(master.end(), {"_publish_clock:=true", "_real_time_factor:=0.5"});
  BaseProcess first("one", master), second("two", parameters("two"));
  first.expect_instants(1);
  second.expect_instants(1);
  ros::NodeHandle node;
  ros::Publisher commands = node.advertise<geometry_msgs::Twist>("/two/cmd_vel", 10);
  wait_for("the node to listen", [&] { return commands.getNumSubscribers() == 1; });
  geometry_msgs::Twist twist;
  twist.linear.x = 0.2;
  commands.publish(twist);
  second.expect_simulated(1);
  twist.linear.x = 0;
  commands.publish(twist);
  second.expect_simulated(0.1);
  const ros::Time end = second.stamps().back();
  for (BaseProcess* base : {&second, &first}) {
    base->interrupt();
  }

  FrameTree frames;
  expect_complete(rosbag::Bag(folder.path("one")), "one", end, 0, frames);
  expect_complete(rosbag::Bag(folder.path("two")), "two", end, 0.2, frames);
  for (const std::string name : {"one/base_footprint", "two/base_footprint"}) EXPECT_TRUE(frames.has(name));
  frames.expect_whole("world");
}

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

/// The launch file plays a scene into the node and records it, then ends, its own master with it: the bag is complete.
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

  static rosbag::Bag bag_;
};

rosbag::Bag PaperCase::bag_;

template <class Message>
void expect_every_instant(const std::vector<Message>& messages) {
  ASSERT_EQ(messages.size(), static_cast<std::size_t>(kInstants));
  for (int k = 0; k < kInstants; ++k) EXPECT_EQ(messages[k].header.stamp, stamp_of(0.02 * k));
}

TEST_F(PaperCase, has_every_topic_at_every_instant) {
  expect_every_instant(read<nav_msgs::Odometry>(bag_, "/odom"));
  expect_every_instant(read<nav_msgs::Odometry>(bag_, "/ground_truth"));
  expect_every_instant(read<sensor_msgs::JointState>(bag_, "/base/joint_states"));
  expect_every_instant(read<ContactsStamped>(bag_, "/contacts"));
  const auto transforms = read<tf2_msgs::TFMessage>(bag_, "/tf");
  ASSERT_EQ(transforms.size(), static_cast<std::size_t>(kInstants));
  for (int k = 0; k < kInstants; ++k) EXPECT_EQ(transforms[k].transforms.at(0).header.stamp, stamp_of(0.02 * k));
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
  const auto truth = read<nav_msgs::Odometry>(bag_, "/ground_truth");
  ASSERT_EQ(truth.size(), static_cast<std::size_t>(kInstants));
  for (std::size_t k = 0; k < truth.size(); ++k) {
    advance_to(simulation, 0.02 * static_cast<double>(k), player);
    const State& x = simulation.state();
    EXPECT_EQ(truth[k].pose.pose.position.x, x.x()) << "at " << simulation.time() << " s";
    EXPECT_EQ(truth[k].pose.pose.position.y, x.y());
    EXPECT_EQ(truth[k].twist.twist.linear.x, x.V_X());
    EXPECT_EQ(truth[k].twist.twist.linear.y, x.V_Y());
    EXPECT_EQ(truth[k].twist.twist.angular.z, x.Omega());
  }
  const auto published = read<RollerSwitchStamped>(bag_, "/base/roller_switches");
  const std::vector<RollerSwitch> expected = simulation.take_switches();
  ASSERT_EQ(published.size(), expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k) {
    EXPECT_EQ(published[k].t, expected[k].t);
    EXPECT_EQ(published[k].phi, expected[k].phi);
    EXPECT_EQ(published[k].wheel, wheel_joint(expected[k].wheel));
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

int main(int argc, char** argv) { return youbot_base_sim::run_rostest(argc, argv); }
