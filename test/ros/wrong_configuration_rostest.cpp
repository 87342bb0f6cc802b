// What is configured wrongly is refused: exit status 2 and a line that names the parameter, the value and what is
// allowed.

#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <string>
#include <vector>

#include "program.h"
#include "rostest_main.h"

namespace youbot_base_sim {
namespace {

constexpr char kPlayedScene[] = "_scene:=" YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case2.yaml";

class WrongConfiguration : public ::testing::Test {
 protected:
  void TearDown() override { ros::param::del("/use_sim_time"); }

  /// Runs a program under a name of its own, so that it finds no parameters of another run.
  void expect_refused(const std::string& program, std::vector<std::string> arguments,
                      const std::vector<std::string>& words) {
    static int number = 0;
    arguments.push_back("__name:=refused_" + std::to_string(++number));
    Program process(program, arguments);
    EXPECT_EQ(process.wait(), 2);
    const std::string output = process.out() + process.err();
    for (const std::string& word : words) {
      EXPECT_NE(output.find(word), std::string::npos) << word << " is not in: " << output;
    }
  }

  void expect_base_refuses(const std::string& argument, const std::vector<std::string>& words) {
    expect_refused(BASE_NODE, {argument}, words);
  }

  TemporaryFolder folder_;
};

TEST_F(WrongConfiguration, misspelt_parameter) {
  expect_base_refuses("_publsh_rate:=20", {"~publsh_rate", "unknown", "publish_rate"});
}

TEST_F(WrongConfiguration, value_out_of_range) {
  expect_base_refuses("_publish_rate:=2000", {"~publish_rate", "2000", "1000 Hz"});
  expect_base_refuses("_control_period:=-1", {"~control_period", "-1", "1e-06 to 10 s"});
  expect_base_refuses("_control_period:=nan", {"~control_period", "nan"});
  expect_base_refuses("_driver_wheel_radius:=0", {"~driver_wheel_radius", "0", "m"});
}

TEST_F(WrongConfiguration, value_of_the_wrong_kind) {
  expect_base_refuses("_publish_rate:=often", {"~publish_rate", "often", "a number"});
  expect_base_refuses("_publish_tf:=3", {"~publish_tf", "3", "true or false"});
  expect_base_refuses("_scene:=3", {"~scene", "3"});
}

TEST_F(WrongConfiguration, parameter_of_the_driver) {
  const auto expect_refused_with = [this](const std::string& name, const auto& value,
                                          const std::vector<std::string>& words) {
    ros::param::set(name, value);
    expect_refused(BASE_NODE, {}, words);
    ros::param::del(name);
  };
  expect_refused_with("youBotHasBase", false, {"youBotHasBase", "false", "true"});
  expect_refused_with("youBotHasBase", 3, {"youBotHasBase", "3", "true or false"});
  expect_refused_with("youBotDriverCycleFrequencyInHz", -50.0, {"youBotDriverCycleFrequencyInHz", "-50", "Hz"});
  expect_refused_with("youBotConfigurationFilePath", "/nowhere",
                      {"youBotConfigurationFilePath", "/nowhere/youbot-base.cfg"});
}

TEST_F(WrongConfiguration, of_motors_and_odometry) {
  expect_base_refuses("_joint_velocity_sign:=left", {"~joint_velocity_sign", "left", "driver_exact"});
  expect_base_refuses("_command_timeout:=-1", {"~command_timeout", "-1", "s"});
  expect_base_refuses("_odometry_wheel_error:=2", {"~odometry_wheel_error", "2"});
  expect_base_refuses("_max_wheel_torque:=-1", {"~max_wheel_torque", "-1", "N m"});
  expect_base_refuses("_command_delay:=61", {"~command_delay", "61", "60 s"});
  expect_base_refuses("_dry_friction:=-0.1", {"~dry_friction", "-0.1", "N m"});
  expect_base_refuses("_command_rate:=1001", {"~command_rate", "1001", "1000 Hz"});
}

TEST_F(WrongConfiguration, scene) {
  expect_base_refuses("_scene:=/nowhere/scene.yaml", {"~scene", "/nowhere/scene.yaml"});
  expect_base_refuses("_model:=sticky", {"~model", "sticky", "coulomb"});
}

TEST_F(WrongConfiguration, clock_of_its_own_but_not_its_master) {
  expect_base_refuses("_lockstep:=true", {"~lockstep", "~publish_clock"});
  expect_base_refuses("_bag:=x.bag", {"~bag", "x.bag", "~publish_clock"});
  expect_base_refuses("_start_paused:=true", {"~start_paused", "~publish_clock"});
  expect_base_refuses("_real_time_factor:=2", {"~real_time_factor", "2", "~publish_clock"});
  ros::param::set("/use_sim_time", true);
  expect_base_refuses("_publish_clock:=false", {"~publish_clock", "/use_sim_time"});
}

TEST_F(WrongConfiguration, bag_that_cannot_be_written) {
  ros::param::set("/use_sim_time", true);
  expect_refused(BASE_NODE, {"_publish_clock:=true", "_bag:=/nowhere/x.bag"}, {"~bag", "/nowhere/x.bag"});
}

TEST_F(WrongConfiguration, argument) { expect_base_refuses("fast", {"fast"}); }

TEST_F(WrongConfiguration, nothing_to_play) {
  expect_refused(PLAY_SCENE, {}, {"~scene", "missing"});
  ros::param::set("/use_sim_time", true);
  const std::string idle = folder_.write("idle.yaml", "duration: 1.0\n");
  expect_refused(PLAY_SCENE, {"_scene:=" + idle}, {"~scene", idle, "drive"});
}

TEST_F(WrongConfiguration, no_clock_to_play_by) { expect_refused(PLAY_SCENE, {kPlayedScene}, {"/use_sim_time"}); }

TEST_F(WrongConfiguration, player_without_a_base_fails_rather_than_waits) {
  ros::param::set("/use_sim_time", true);
  bool started = false;
  ros::NodeHandle node;
  const ros::Subscriber subscriber = node.subscribe<nav_msgs::Odometry>(
      "odom", 1,
      [&](const nav_msgs::Odometry::ConstPtr& message) { started = message->header.stamp > ros::Time(0.1); });
  Program base(BASE_NODE, {"_publish_clock:=true", "_lockstep:=true", "__name:=doomed"});
  Program player(PLAY_SCENE, {kPlayedScene, "_duration:=1e6"});
  const auto limit = ros::WallTime::now() + ros::WallDuration(15);
  while (!started && ros::WallTime::now() < limit) ros::getGlobalCallbackQueue()->callOne(ros::WallDuration(0.1));
  EXPECT_TRUE(started);
  base.kill();
  EXPECT_EQ(player.wait(), 1) << player.err();
  EXPECT_NE((player.out() + player.err()).find("/doomed is gone"), std::string::npos) << player.err();
  base.wait();
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
