// What stalls or overloads: a subscriber that stands still or reads no more, the node itself stopped for a while,
// 10,000 commands a second. Memory stays bounded, lost time is told, and the node goes on.

#include <geometry_msgs/Twist.h>

#include <algorithm>
#include <csignal>

#include "base_process.h"
#include "rostest_main.h"

namespace youbot_base_sim {
namespace {

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
  base.send(SIGINT);
  base.expect_end(0);
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
  base.send(SIGINT);
  base.expect_end(0);
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
  base.send(SIGINT);
  base.expect_end(0, "s are lost");
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
  base.send(SIGINT);
  base.expect_end(0);
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
