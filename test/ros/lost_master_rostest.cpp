// The node goes on where roscore is killed, and where it comes back; its bag is whole in the end. It does not register
// with the new one, as no ROS 1 node does.

#include <ros/ros.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <csignal>
#include <cstdlib>
#include <memory>

#include "free_port.h"
#include "program.h"
#include "promises/refusals.h"
#include "rostest_main.h"

namespace youbot_base_sim {
namespace {

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
    const auto limit = ros::WallTime::now() + ros::WallDuration(20);
    while (base->out().find("model coulomb") == std::string::npos && ros::WallTime::now() < limit) let_pass(0.05);
    return base;
  }

  static void let_pass(double wall_time) { ros::WallDuration(wall_time).sleep(); }

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
  let_pass(0.4);
  expect_end(*first, "first", 0.3);
  start_master();
  let_pass(0.8);
  expect_end(*second, "second", 1.0);
}

TEST_F(LostMaster, need_not_be_there_for_the_node_to_end) {
  const std::string nowhere = "__master:=http://localhost:" + std::to_string(free_port());
  Program base(BASE_NODE, {nowhere}), player(PLAY_SCENE, {nowhere});
  for (Program* program : {&base, &player}) {
    const auto limit = ros::WallTime::now() + ros::WallDuration(20);
    const auto said = [program] { return program->out() + program->err(); };
    while (said().find("Failed to contact master") == std::string::npos && ros::WallTime::now() < limit) let_pass(0.05);
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
    for (const char* path : {BASE_NODE, PLAY_SCENE}) {
      Program program(path, {wrong[0]});
      EXPECT_EQ(program.wait(), 2) << wrong[0];
      EXPECT_EQ(program.out(), "");
      std::string line = program.err();
      ASSERT_FALSE(line.empty());
      line.pop_back();
      expect_refusal(line, {wrong[1]});
    }
  }
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
