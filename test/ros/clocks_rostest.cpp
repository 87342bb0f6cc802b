// A node's time: by another node's clock, waiting, and overloaded.

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/Twist.h>
#include <nav_msgs/Odometry.h>
#include <ros/master.h>
#include <rosgraph_msgs/Clock.h>
#include <tf2_msgs/TFMessage.h>
#include <youbot_base_sim/SetState.h>

#include <algorithm>
#include <csignal>
#include <map>
#include <set>

#include "base_process.h"
#include "youbot_base_sim/ros/conversions.h"

namespace youbot_base_sim {
namespace {

/// base_node follows the /clock of another node, and names two nodes that publish it.
class Clocks : public ::testing::Test {
 protected:
  void publish(double t) const {
    rosgraph_msgs::Clock message;
    message.clock = ros::Time(t);
    clock_.publish(message);
  }

  const SimulatedTime simulated_time_;
  ros::NodeHandle node_;
  ros::Publisher clock_ = node_.advertise<rosgraph_msgs::Clock>("/clock", 100, true);
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
  base.interrupt("s to 7");
}

TEST_F(Clocks, is_waited_for) {
  BaseProcess base("early", {});
  EXPECT_TRUE(base.call("/base/switchOnMotors")) << "answered meanwhile";
  ros::WallDuration(1.5).sleep();
  base.interrupt("time waits for another node's /clock");
  EXPECT_NE(base.said().find("WARN"), std::string::npos) << base.said();
  EXPECT_NE(base.said().find("rosparam set /use_sim_time false"), std::string::npos) << base.said();
}

TEST_F(Clocks, two_are_named) {
  publish(1);
  BaseProcess base("rival", {"_publish_clock:=true", "_real_time_factor:=10"});
  base.expect_simulated(4);
  base.interrupt(ros::this_node::getName());
  EXPECT_NE(base.said().find("/clock has several publishers, "), std::string::npos) << base.said();
  EXPECT_NE(base.said().find("/rival/base"), std::string::npos) << base.said();
}

TEST_F(Clocks, one_is_none_too_many) {
  clock_.shutdown();
  const ros::Publisher commands = node_.advertise<geometry_msgs::Twist>("/alone/cmd_vel", 1);
  BaseProcess base("alone", {"_publish_clock:=true", "_real_time_factor:=10"});
  base.expect_simulated(4);
  base.interrupt();
  for (const char* warning : {"several publishers", "comes from", "without effect"})
    EXPECT_EQ(base.said().find(warning), std::string::npos) << base.said();
}

constexpr char kNewcomers[] = R"(
import rospy
from rosgraph_msgs.msg import Clock
rospy.init_node("newcomer", disable_rostime=True)
for _ in range(30):
    times = []
    subscriber = rospy.Subscriber("/clock", Clock, lambda message, times=times: times.append(message.clock))
    while len(times) < 100:
        rospy.rostime.wallsleep(0.01)
    subscriber.unregister()
    assert times == sorted(times)
)";

TEST_F(Clocks, neither_goes_back_for_a_newcomer_nor_comes_after_what_happens) {
  clock_.shutdown();
  std::set<ros::Time> times, jumps;
  const auto clock =
      node_.subscribe<rosgraph_msgs::Clock>("/clock", 0, [&](const auto& message) { times.insert(message->clock); });
  const auto states = node_.subscribe<nav_msgs::Odometry>(
      "/hurried/state_set", 0, [&](const auto& message) { jumps.insert(message->header.stamp); });
  BaseProcess base("hurried", {"_publish_clock:=true", "_real_time_factor:=0"});
  base.expect_simulated(1);
  SetState jump;
  for (int k = 0; k < 5; ++k) EXPECT_TRUE(call_service("/hurried/base/set_state", jump));
  wait_for("all jumps", [&] { return jumps.size() == 5 && *jumps.rbegin() < *times.rbegin(); });
  for (const ros::Time& t : jumps) EXPECT_LE(*times.lower_bound(t) - t, ros::Duration(0.001));
  Program newcomers(PYTHON, {"-c", kNewcomers});
  EXPECT_EQ(newcomers.wait(), 0) << newcomers.err();
  base.interrupt();
}

// What other nodes do that disturbs this one: sources of its odometry and transform, commanders beside each other, and
// parameters that are set too late. In lockstep it does not look: a run would depend on when it asks the master.
TEST(Lookout, names_others) {
  const std::string me = ros::this_node::getName();
  ros::NodeHandle node("shared");
  const ros::Publisher odometry = node.advertise<nav_msgs::Odometry>("odom", 1);
  const ros::Publisher commands = node.advertise<geometry_msgs::Twist>("cmd_vel", 1);
  const ros::Publisher transforms = node.advertise<tf2_msgs::TFMessage>("/tf", 1);
  XmlRpc::XmlRpcValue other, response, payload;  // as a second node would register
  other[0] = "/second";
  other[1] = "/shared/cmd_vel";
  other[2] = "geometry_msgs/Twist";
  other[3] = "http://localhost:1/";
  ASSERT_TRUE(ros::master::execute("registerPublisher", other, response, payload, false));
  tf2_msgs::TFMessage message;
  for (const char* child : {"base_footprint", "base_laser"})
    message.transforms.push_back(transform_message("map", child, {0, 0, 0}, ros::Time::now()));
  BaseProcess base("shared", {"_command_timeout:=1"});
  const auto expect = [&](const std::vector<std::string>& warnings) {
    for (const std::string& warning : warnings)
      wait_for(warning, [&] {
        transforms.publish(message);
        return base.said().find(warning) != std::string::npos;
      });
  };
  expect({"odom comes from " + me, "cmd_vel comes from ", "/second", "TF map -> base_footprint comes from " + me});
  for (const int value : {2, 3}) {
    ros::param::set("/shared/base/command_timeout", value);
    expect({fmt::format("parameter ~command_timeout = {} is set too late, without effect", value)});
  }
  EXPECT_EQ(base.said().find("base_laser"), std::string::npos) << "another's child";
}

// A node whose time waits says for what, on the console and in /diagnostics, by the names of topics where it runs.
TEST(Waits, are_told) {
  const SimulatedTime simulated_time;
  struct Case {
    std::vector<std::string> arguments;
    std::string words;
  };
  const std::map<std::string, Case> cases = {
      {"subscribers",
       {{"_wait_for_subscribers:=true", "base/joint_states:=wheels"},
        " /subscribers/wheels /subscribers/base/roller_switches"}},
      {"lockstep",
       {{"_lockstep:=true", "cmd_vel:=/go"},
        "lockstep: the simulation begins with ~unpause or a command on /go, "
        "/lockstep/base/base_controller/torques_command or /lockstep/base/"}},
      {"paused", {{"_start_paused:=true"}, "time waits, paused at t = 0 s, for ~unpause or ~step"}}};
  ros::NodeHandle node;
  std::map<std::string, int> warnings;
  const ros::Subscriber diagnostics = node.subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 100, [&](const diagnostic_msgs::DiagnosticArray::ConstPtr& message) {
        for (const auto& status : message->status) {
          for (const auto& [ns, expected] : cases)
            warnings[ns] += status.name == ns + "/youbot_base_sim: time" && status.level == status.WARN &&
                            status.message.find(expected.words) != std::string::npos;
        }
      });
  std::map<std::string, std::unique_ptr<BaseProcess>> nodes;
  for (const auto& [ns, expected] : cases) {
    std::vector<std::string> arguments = expected.arguments;
    arguments.push_back("_publish_clock:=true");
    nodes[ns] = std::make_unique<BaseProcess>(ns, arguments);
  }
  for (const auto& [ns, expected] : cases) {
    wait_for(expected.words, [&, name = ns] { return warnings[name] > 0; });
    nodes[ns]->interrupt(expected.words);
  }
}

// Overloads leave memory bounded, the node says what time it lost, and goes on.
TEST(Overload, stalled_subscriber_costs_no_more_than_its_queue) {
  // Not faster: beside other work roscpp's own sending thread falls behind a loop that never waits, and has no limit.
  BaseProcess base("talker", {"_publish_clock:=true", "_real_time_factor:=10", "_publish_rate:=1000"});
  Program listener("/usr/bin/env", {"rostopic", "echo", "/talker/odom/header/seq"});
  wait_for("the listener", [&] { return !listener.out().empty(); });
  listener.send(SIGSTOP);
  base.expect_simulated(5);  // fills the buffers of the system
#ifdef YOUBOT_BASE_SIM_SANITIZERS
  base.expect_simulated(10);  // slowly; and they keep what was freed
#else
  const double before = base.memory();
  base.expect_simulated(40);  // 30 MB of odometry
  EXPECT_LT(base.memory() - before, 8.0) << "MB";
#endif
  listener.send(SIGKILL);
  listener.wait();
  base.expect_instants(10);
  base.interrupt();
}

/// A node without a library that subscribes to the topics it is given, and reads nothing of what comes.
constexpr char kReadsNothing[] = R"(
import os, socket, struct, sys, time, xmlrpc.client
master = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])
server = socket.create_server(("localhost", 0))
uri = "http://localhost:%d/" % server.getsockname()[1]
links = []
for topic, kind in zip(sys.argv[1::2], sys.argv[2::2]):
    while not (publishers := master.registerSubscriber("/mute", topic, kind, uri)[2]):
        time.sleep(0.1)
    protocol = xmlrpc.client.ServerProxy(publishers[0]).requestTopic("/mute", topic, [["TCPROS"]])[2]
    links.append(socket.socket())
    links[-1].setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
    links[-1].connect(tuple(protocol[1:3]))
    fields = ["callerid=/mute", "topic=" + topic, "type=" + kind, "md5sum=*", "tcp_nodelay=1"]
    header = b"".join(struct.pack("<I", len(field)) + field.encode() for field in fields)
    links[-1].sendall(struct.pack("<I", len(header)) + header)
print("there", flush=True)
server.accept()
)";

TEST(Overload, subscriber_that_reads_no_more_holds_up_neither_lockstep_nor_others) {
  BaseProcess base("locked",
                   {"_publish_clock:=true", "_lockstep:=true", "_lockstep_period:=0.1", "_publish_rate:=1000"});
  ros::NodeHandle node;
  ros::Publisher publisher = node.advertise<geometry_msgs::Twist>("/locked/cmd_vel", 1);
  wait_for("the node to listen", [&] { return publisher.getNumSubscribers() > 0; });
  Program mute(PYTHON, {"-c", kReadsNothing, "/clock", "rosgraph_msgs/Clock", "/locked/odom", "nav_msgs/Odometry"});
  wait_for("the subscriber", [&] { return !mute.out().empty(); });
  publisher.publish(geometry_msgs::Twist());
  for (int k = 0; k < 4; ++k) base.expect_simulated(1);  // fills the system's buffers and the queue
  const double before = base.memory();
  for (int k = 0; k < 3; ++k) base.expect_simulated(1);
  EXPECT_LT(base.memory() - before, 0.5) << "MB, of 2 MB of odometry";
  EXPECT_TRUE(std::is_sorted(base.stamps().begin(), base.stamps().end()));
  base.interrupt();
  EXPECT_EQ(base.said().find("has not rested"), std::string::npos) << base.said();
}

TEST(Overload, node_that_was_stopped_tells_what_it_lost_and_goes_on) {
  BaseProcess base("stopped", {});
  base.expect_instants(5);
  base.send(SIGSTOP);
  ros::WallDuration(1.5).sleep();
  base.send(SIGCONT);
  base.expect_instants(20);
  EXPECT_TRUE(std::is_sorted(base.stamps().begin(), base.stamps().end()));
  base.interrupt("s are lost");
}

TEST(Overload, last_of_ten_thousand_commands_a_second_counts) {
  BaseProcess base("commanded", {"_quantized:=false"});
  ros::NodeHandle node;
  ros::Publisher publisher = node.advertise<geometry_msgs::Twist>("/commanded/cmd_vel", 100000);
  wait_for("the node to listen", [&] { return publisher.getNumSubscribers() > 0; });
  base.expect_instants(1);
  geometry_msgs::Twist twist;
  for (int k = 0; k < 10000; ++k) {
    twist.linear.x = k % 2 == 0 ? 0.7 : -0.7;
    publisher.publish(twist);
    if (k % 10 == 0) ros::WallDuration(1e-3).sleep();
  }
  twist.linear.x = 0.2;
  publisher.publish(twist);
  // The base also passes 0.2 m/s on its way to the commands before.
  std::size_t reached = base.stamps().size();
  wait_for("the last command", [&] {
    if (!(std::abs(base.velocity() - 0.2) < 1e-3)) reached = base.stamps().size();
    return base.stamps().size() >= reached + 20;
  });
  base.interrupt();
}

}  // namespace
}  // namespace youbot_base_sim

int main(int argc, char** argv) { return youbot_base_sim::run_rostest(argc, argv); }
