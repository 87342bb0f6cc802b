// base_node and play_scene end soon, in a normal way and with whole files, whatever ends them.

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/Twist.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <rosgraph_msgs/Clock.h>
#include <youbot_base_sim/Step.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <list>
#include <memory>
#include <thread>

#include "base_process.h"
#include "free_port.h"
#include "promises/refusals.h"
#include "rostest.h"
#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/ros/topics.h"

namespace youbot_base_sim {
namespace {

class Endings : public ::testing::Test {
 protected:
  std::string bag(const std::string& name) const { return "_bag:=" + folder_.path(name); }

  /// The bag is there, alone, and has odometry of every instant up to `end` or later.
  void expect_whole(const std::string& name, const ros::Time& end) const {
    for (const auto& file : std::filesystem::directory_iterator(folder_.path(""))) {
      const std::string other = file.path().filename();
      EXPECT_TRUE(other == name || other.rfind(name, 0) != 0) << other;
    }
    const rosbag::Bag bag(folder_.path(name));
    int instants = 0;
    for (const rosbag::MessageInstance& message : rosbag::View(bag)) {
      if (message.getDataType() != "nav_msgs/Odometry" || message.getTopic().find("odom") == std::string::npos)
        continue;
      EXPECT_EQ(message.getTime(), stamp_of(0.02 * instants));
      ++instants;
    }
    EXPECT_GE(stamp_of(0.02 * (instants - 1)), end);
  }

  TemporaryFolder folder_;
};

TEST_F(Endings, signals_leave_a_whole_bag) {
  std::list<BaseProcess> bases;
  constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP};
  for (const int signal : kSignals) {
    const std::string name = "signal_" + std::to_string(signal);
    bases.emplace_back(name, std::vector<std::string>{"_publish_clock:=true", bag(name + ".bag")});
  }
  auto base = bases.begin();
  for (const int signal : kSignals) {
    base->expect_instants(20);
    base->send(signal);
    base->expect_end(0);
    expect_whole("signal_" + std::to_string(signal) + ".bag", base->stamps().back());
    ++base;
  }
}

// As of `base_node &` in a script.
TEST_F(Endings, interrupt_ends_a_node_in_the_background) {
  BaseProcess base("background", {"_publish_clock:=true"}, {"/bin/bash", "-c", "trap '' INT; exec \"$@\"", "bash"});
  base.expect_instants(1);
  base.interrupt();
}

TEST_F(Endings, bag_that_cannot_be_put_in_its_place_is_told) {
  const std::string folder = folder_.path("removed");
  std::filesystem::create_directory(folder);
  BaseProcess base("removed", {"_publish_clock:=true", "_bag:=" + folder + "/x.bag"});
  base.expect_instants(1);
  std::filesystem::remove_all(folder);
  base.send(SIGINT);
  base.expect_end(1, folder + "/x.bag");
}

TEST_F(Endings, do_not_wait_for_what_the_loop_waits_for) {
  std::list<BaseProcess> bases;
  const auto start = [&](const std::string& name, const std::vector<std::string>& parameters) {
    bases.emplace_back(name, parameters);
  };
  start("publishes_rarely", {"_publish_rate:=0.001"});
  // Velocity loops would be unstable.
  const std::string proportional = "_velocity_proportional_gain:=0", integral = "_velocity_integral_gain:=0";
  start("long_period", {"_control_period:=10", "_publish_rate:=0.001", proportional, integral});
  start("slow_motion",
        {"_publish_clock:=true", "_real_time_factor:=0.001", "_control_period:=10", proportional, integral});
  start("lockstep", {"_publish_clock:=true", "_lockstep:=true"});
  start("paused", {"_publish_clock:=true", "_start_paused:=true"});
  for (BaseProcess& base : bases) {
    EXPECT_TRUE(base.call("/base/switchOffMotors")) << "answered while it waits";
    base.interrupt();
  }
}

// What ends a node in lockstep with a node that commands once and sleeps, and how much of its bag there is then.
TEST_F(Endings, in_lockstep_leave_a_whole_bag) {
  const SimulatedTime simulated_time;
  const auto start = [&](const std::string& name, const std::string& parameter) {
    return std::vector<std::string>{"_publish_clock:=true", "_real_time_factor:=0", "_lockstep:=true", parameter,
                                    bag(name)};
  };
  ros::NodeHandle node;
  const auto command = [&](const std::string& name) {
    ros::Publisher commands = node.advertise<geometry_msgs::Twist>("/" + name + "/cmd_vel", 1, true);
    commands.publish(geometry_msgs::Twist());
    return commands;
  };
  {
    BaseProcess base("deadline", start("deadline.bag", "_end_time:=0.5"));
    const ros::Publisher commands = command("deadline");
    base.expect_end(0, "~end_time has come: the node ends at t = 0.5 s");
    expect_whole("deadline.bag", ros::Time(0.5));
  }
  {
    BaseProcess base("service", start("service.bag", "_end_time:=1000"));
    const ros::Publisher commands = command("service");
    base.expect_simulated(2);
    EXPECT_TRUE(base.call("/base/end"));
    base.expect_end(0, "~end is called");
    expect_whole("service.bag", ros::Time(0.3));
  }
  {
    BaseProcess base("exit", start("exit.bag", "_end_with_commands:=true"));
    ros::Publisher commands = command("exit");
    base.expect_simulated(2);
    commands.shutdown();
    base.expect_end(0, "the last publisher of commands has gone");
    expect_whole("exit.bag", ros::Time(0.3));
  }
}

// This test follows /clock and never rests. Who wants a result all the same says so.
TEST_F(Endings, in_lockstep_with_a_node_that_was_given_up_are_errors) {
  const SimulatedTime simulated_time;
  ros::NodeHandle node;
  std::atomic<bool> done{false};
  std::thread busy([&done] {
    while (!done) continue;
  });
  for (const std::string strict : {"true", "false"}) {
    BaseProcess base(strict, {"_publish_clock:=true", "_real_time_factor:=0", "_lockstep:=true", "_end_time:=0.1",
                              "_lockstep_timeout:=0.5", "_lockstep_strict:=" + strict, bag(strict)});
    const ros::Subscriber clock = node.subscribe<rosgraph_msgs::Clock>(
        "/clock", 1, +[](const rosgraph_msgs::Clock::ConstPtr&) {});
    wait_for("the clock", [&] { return clock.getNumPublishers() > 0; });
    EXPECT_TRUE(base.call("/base/unpause"));
    base.expect_end(strict == "true" ? 1 : 0, "has not rested for 0.5 s");
    EXPECT_EQ(folder_.has(strict), strict == "false");
    EXPECT_EQ(base.said().find("(~lockstep_strict)") != std::string::npos, strict == "true") << base.said();
  }
  done = true;
  busy.join();
}

// Before the first command only /clock advances.
TEST_F(Endings, lockstep_that_idles_begins_with_unpause) {
  const SimulatedTime simulated_time;
  BaseProcess base("idle", {"_publish_clock:=true", "_lockstep:=true", "_real_time_factor:=0"});
  base.expect_instants(3);
  EXPECT_TRUE(base.call("/base/unpause"));
  base.expect_simulated(1);
  base.interrupt();
}

// As in another container than the master's.
TEST_F(Endings, lockstep_goes_on_where_the_master_cannot_be_seen) {
  if (std::system("unshare -pf --mount-proc true") != 0) GTEST_SKIP() << "needs a root that may make namespaces";
  const SimulatedTime simulated_time;
  ros::NodeHandle node;
  ros::Time now;
  const ros::Subscriber clock = node.subscribe<rosgraph_msgs::Clock>(
      "/clock", 100, [&](const rosgraph_msgs::Clock::ConstPtr& message) { now = message->clock; });
  const BaseProcess base("hidden", {"_publish_clock:=true", "_lockstep:=true"},
                         {"/usr/bin/unshare", "-pf", "--mount-proc", "--kill-child"});
  wait_for("time to pass", [&] { return now > ros::Time(0.1); });
}

TEST_F(Endings, signal_ends_a_step_of_any_length) {
  BaseProcess base("stepping", {"_publish_clock:=true", "_start_paused:=true"});
  ASSERT_TRUE(base.call("/base/pause"));
  bool succeeded = true;
  std::thread step([&] {
    Step service;
    service.request.periods = 4000000000;
    succeeded = call_service("/stepping/base/step", service) && service.response.success;
  });
  base.expect_instants(10);
  EXPECT_TRUE(base.call("/base/switchOffMotors")) << "answered meanwhile";
  base.send(SIGTERM);
  base.expect_end(0);
  step.join();
  EXPECT_FALSE(succeeded);
}

TEST_F(Endings, signals_end_the_player) {
  const SimulatedTime simulated_time;
  Program player(PLAY_SCENE, {"_scene:=" YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case2.yaml", "__name:=player"});
  ros::NodeHandle node;
  int commands = 0;
  const ros::Subscriber subscriber = node.subscribe<brics_actuator::JointTorques>(
      kTorqueTopic, 1, [&commands](const brics_actuator::JointTorques::ConstPtr&) { ++commands; });
  wait_for("the player", [&] { return subscriber.getNumPublishers() > 0; });
  player.send(SIGTERM);
  EXPECT_EQ(player.wait(), 1) << player.out() << player.err();
  EXPECT_NE((player.out() + player.err()).find("interrupted at t = 0 s"), std::string::npos) << player.err();
  EXPECT_EQ(commands, 0) << "without a clock";
}

TEST_F(Endings, second_node_of_the_same_name_takes_over) {
  BaseProcess first("twin", {"_publish_clock:=true", bag("first")});
  first.expect_instants(20);
  BaseProcess second("twin", {"_publish_clock:=true", bag("second")});
  first.expect_end(0, "new node registered with same name");
  expect_whole("first", ros::Time(0.3));
  second.expect_simulated(0.4);  // since what it heard last, which may be of the first one
  second.interrupt();
  expect_whole("second", ros::Time(0.3));
}

/// What stands before base_node so that none of its files grows beyond 512 kB, as on a disk that is full.
const std::vector<std::string> kSmallDisk = {"/bin/bash", "-c", "trap '' XFSZ; ulimit -f 512; exec \"$@\"", "bash"};

TEST_F(Endings, full_disk_ends_a_node_whose_bag_is_required) {
  BaseProcess base("required", {"_publish_clock:=true", "_real_time_factor:=0", "_publish_rate:=1000", bag("full")},
                   kSmallDisk);
  base.expect_end(1, "the bag has failed: " + folder_.path("full"));
  EXPECT_FALSE(folder_.has("full"));
}

TEST_F(Endings, full_disk_is_told_by_a_node_that_goes_on) {
  using diagnostic_msgs::DiagnosticStatus;
  DiagnosticStatus bag_status;
  ros::NodeHandle node;
  const ros::Subscriber subscriber = node.subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 1000, [&](const diagnostic_msgs::DiagnosticArray::ConstPtr& message) {
        for (const auto& status : message->status) {
          if (status.name == "optional/youbot_base_sim: bag") bag_status = status;
        }
      });
  BaseProcess base(
      "optional",
      {"_publish_clock:=true", "_real_time_factor:=10", "_publish_rate:=1000", bag("full"), "_bag_required:=false"},
      kSmallDisk);
  wait_for("a failed bag", [&] { return bag_status.level == DiagnosticStatus::ERROR; });
  EXPECT_NE(bag_status.message.find(folder_.path("full")), std::string::npos) << bag_status.message;
  base.expect_instants(100);
  base.interrupt("the bag has failed, the node goes on without it: " + folder_.path("full"));
  EXPECT_EQ(base.said().find("the bag has failed"), base.said().rfind("the bag has failed")) << "told once";
}

/// The node goes on where roscore is killed, and where it comes back; its bag is whole in the end. It does not register
/// with the new one, as no ROS 1 node does.
class LostMaster : public ::testing::Test {
 protected:
  LostMaster() { start_master(); }
  ~LostMaster() override { kill_master(); }

  void start_master() {
    master_ = std::make_unique<Program>("/usr/bin/env",
                                        std::vector<std::string>{"rosmaster", "--core", "-p", std::to_string(port_)});
  }

  void kill_master() {
    master_->send(SIGKILL);
    master_->wait();
  }

  /// A node whose master is this one; it waits for it if need be.
  std::unique_ptr<Program> start_base(const std::string& bag) {
    auto base = std::make_unique<Program>(
        BASE_NODE, std::vector<std::string>{"__master:=http://localhost:" + std::to_string(port_), "__name:=" + bag,
                                            "_publish_clock:=true", "_bag:=" + folder_.path(bag)});
    wait_for("the node", [&] { return base->out().find("model coulomb") != std::string::npos; });
    return base;
  }

  void expect_end(Program& base, const std::string& bag, double min_time) {
    base.send(SIGINT);
    EXPECT_EQ(base.wait(), 0) << base.out() << base.err();
    rosbag::Bag file(folder_.path(bag));
    EXPECT_GE(rosbag::View(file).getEndTime(), ros::Time(min_time)) << "went on";
  }

  const int port_ = free_port();
  TemporaryFolder folder_;
  std::unique_ptr<Program> master_;
};

TEST_F(LostMaster, does_not_stop_the_node_or_spoil_its_bag) {
  setenv("ROSCONSOLE_STDOUT_LINE_BUFFERED", "1", 1);
  const auto first = start_base("first"), second = start_base("second");
  kill_master();
  ros::WallDuration(0.4).sleep();
  expect_end(*first, "first", 0.3);
  start_master();
  ros::WallDuration(0.8).sleep();
  expect_end(*second, "second", 1.0);
}

TEST_F(LostMaster, need_not_be_there_for_the_node_to_end) {
  const std::string nowhere = "__master:=http://localhost:" + std::to_string(free_port());
  Program base(BASE_NODE, {nowhere}), player(PLAY_SCENE, {nowhere});
  for (Program* program : {&base, &player}) {
    const auto said = [program] { return program->out() + program->err(); };
    wait_for("its words", [&] { return said().find("Failed to contact master") != std::string::npos; });
    program->send(SIGINT);
    EXPECT_EQ(program->wait(), 1) << said();
    EXPECT_NE(said().find("interrupted before there was a master"), std::string::npos) << said();
  }
}

// roscpp would abort, or stop at a breakpoint.
TEST(Start, is_refused_with_a_name_or_an_address_that_cannot_be) {
  const std::vector<std::vector<std::string>> cases = {{"__name:=a/b", "a/b"},
                                                       {"__name:=1x", "1x"},
                                                       {"__ns:=a b", "a b"},
                                                       {"cmd_vel:=a@", "a@"},
                                                       {"__master:=garbage", "garbage"},
                                                       {"__master:=", "ROS_MASTER_URI"},
                                                       {"__master:=http://h", "HOST"},
                                                       {"__master:=http://localhost:65536", "65536"}};
  for (const auto& wrong : cases) {
    for (const char* path : {BASE_NODE, PLAY_SCENE})
      expect_program_refuses(TemporaryFolder(), path, {wrong[0]}, {wrong[1]});
  }
}

}  // namespace
}  // namespace youbot_base_sim

int main(int argc, char** argv) { return youbot_base_sim::run_rostest(argc, argv); }
