// Simulated time of another node: base_node follows its /clock. Two nodes that publish /clock are named.

#include <rosgraph_msgs/Clock.h>

#include <csignal>

#include "base_process.h"
#include "rostest_main.h"

namespace youbot_base_sim {
namespace {

class Clocks : public ::testing::Test {
 protected:
  Clocks() : clock_(node_.advertise<rosgraph_msgs::Clock>("/clock", 100, true)) {
    ros::param::set("/use_sim_time", true);
  }
  ~Clocks() override { ros::param::del("/use_sim_time"); }

  void publish(double t) const {
    rosgraph_msgs::Clock message;
    message.clock = ros::Time(t);
    clock_.publish(message);
  }

  ros::NodeHandle node_;
  ros::Publisher clock_;
};

TEST_F(Clocks, of_another_node_is_followed) {
  BaseProcess base("follower", {});
  double t = 100;
  const auto last = [&] { return base.stamps().empty() ? 0 : base.stamps().back().toSec(); };
  const auto advance_until = [&](const char* what, const std::function<bool()>& happened) {
    wait_for(what, [&] {
      if (happened()) return true;
      publish(t += 0.01);
      return false;
    });
  };
  advance_until("odometry", [&] { return last() > 100; });
  for (int k = 0; k < 100; ++k) {
    publish(t += 0.01);
    wait_for("odometry", [&] { return last() > t - 0.02 - 1e-6; });
  }
  EXPECT_LE(last(), t + 1e-9);
  const std::size_t instants = base.stamps().size();
  EXPECT_GE(instants, 49u);

  ros::WallDuration(0.3).sleep();
  ros::getGlobalCallbackQueue()->callAvailable();
  EXPECT_LE(base.stamps().size(), instants + 1) << "time stands still";

  t = 7;
  advance_until("the past", [&] { return last() < 50 && last() > 7.2; });
  EXPECT_LE(last(), t + 1e-9) << "on from there";
  base.send(SIGINT);
  base.expect_end(0, "s to 7");
}

TEST_F(Clocks, is_waited_for) {
  BaseProcess base("early", {});
  EXPECT_TRUE(base.call("/base/switchOnMotors")) << "answered meanwhile";
  ros::WallDuration(1.5).sleep();
  base.send(SIGINT);
  base.expect_end(0, "time waits for another node's /clock");
}

TEST_F(Clocks, two_are_named) {
  publish(1);
  BaseProcess base("rival", {"_publish_clock:=true", "_real_time_factor:=10"});
  base.expect_simulated(4);
  base.send(SIGINT);
  base.expect_end(0, ros::this_node::getName());
  EXPECT_NE(base.said().find("/clock has several publishers, "), std::string::npos) << base.said();
  EXPECT_NE(base.said().find("/rival/base"), std::string::npos) << base.said();
}

TEST_F(Clocks, one_is_none_too_many) {
  clock_.shutdown();
  BaseProcess base("alone", {"_publish_clock:=true", "_real_time_factor:=10"});
  base.expect_simulated(4);
  base.send(SIGINT);
  base.expect_end(0);
  EXPECT_EQ(base.said().find("several publishers"), std::string::npos) << base.said();
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
