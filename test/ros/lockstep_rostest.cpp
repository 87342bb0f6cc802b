// Simulated time waits for ordinary nodes until they rest, and goes on as fast as it can: loops of any rate, timers,
// one command and a long sleep, actions, transforms of the present.

#include <actionlib/TestAction.h>
#include <actionlib/client/simple_action_client.h>
#include <actionlib/server/simple_action_server.h>
#include <diagnostic_msgs/DiagnosticArray.h>
#include <ros/rate.h>
#include <tf2_ros/transform_listener.h>
#include <youbot_base_sim/SetState.h>

#include <algorithm>
#include <atomic>
#include <string>
#include <vector>

#include "base_client.h"
#include "log.h"

namespace youbot_base_sim {
namespace {

constexpr double kPeriod = 0.01;  // s, of lockstep

/// Sleeps until /clock has advanced: a thread that a connection or /clock's message has woken may read the time while
/// it changes, and sleep a period too long.
void go_by_the_clock(BaseClient& base) {
  wait_for("a reset to reach roscpp's time", [&] { return ros::Time::now() <= base.clock(); });
  ros::Duration(2 * kPeriod).sleep();
  ros::spinOnce();
}

/// A publisher of commands that the base hears. Returns when /clock has advanced.
ros::Publisher commander(BaseClient& base) {
  ros::NodeHandle node;
  const ros::Publisher commands = node.advertise<geometry_msgs::Twist>(kTwistTopic, 1);
  wait_for("the base to listen", [&] { return commands.getNumSubscribers() > 0; });
  go_by_the_clock(base);
  return commands;
}

/// Forward, the faster the further from 0.3 m.
geometry_msgs::Twist towards(double x) { return twist(std::min(0.5, 2 * (0.3 - x)), 0, 0); }

/// Where the base was each time that a loop of this rate (Hz) looked, in `loops` of them.
std::vector<double> drive_ahead(BaseClient& base, double rate_of_loop, int loops) {
  const ros::Publisher commands = commander(base);
  std::vector<double> seen;
  ros::Rate rate(rate_of_loop);
  const ros::Time start = ros::Time::now();
  for (int k = 0; k < loops && ros::ok(); ++k) {
    commands.publish(towards(k == 0 ? 0 : base.odometry.pose.pose.position.x));
    rate.sleep();
    ros::spinOnce();
    seen.insert(seen.end(), {base.odometry.pose.pose.position.x, base.truth.pose.pose.position.x});
  }
  EXPECT_NEAR((ros::Time::now() - start).toSec(), loops / rate_of_loop, kPeriod + 1e-6) << "by simulated time";
  return seen;
}

TEST(Lockstep, a_closed_loop_of_any_rate_is_the_same_to_the_bit) {
  for (const double rate : {50.0, 30.0, 100.0}) {
    const std::vector<double> expected = drive_ahead(BaseClient::fresh(), rate, 40);
    EXPECT_GT(expected.back(), 0.05);
    for (int run = 1; run < 3; ++run) EXPECT_EQ(drive_ahead(BaseClient::fresh(), rate, 40), expected) << rate << run;
  }
}

/// Where the base is after one command and a sleep of 2 s.
std::vector<double> command_and_sleep(BaseClient& base) {
  commander(base).publish(twist(0.2, 0, 0));
  ros::Duration(2).sleep();
  ros::spinOnce();
  return {base.odometry.pose.pose.position.x, base.truth.pose.pose.position.x};
}

TEST(Lockstep, one_command_holds_through_a_sleep) {
  BaseClient& base = BaseClient::fresh();
  const Log& log = Log::of(base);
  base.reset();
  const std::vector<double> expected = command_and_sleep(base);
  EXPECT_NEAR(expected.front(), 0.4, 0.05);
  EXPECT_EQ(command_and_sleep(BaseClient::fresh()), expected);
  EXPECT_EQ(log.count(rosgraph_msgs::Log::WARN, "lockstep"), 0u);
}

TEST(Lockstep, commands_by_the_wall_clock_are_counted) {
  BaseClient& base = BaseClient::fresh();
  std::string counted;
  const ros::Subscriber diagnostics =
      ros::NodeHandle().subscribe<diagnostic_msgs::DiagnosticArray>(kDiagnosticsTopic, 10, [&](const auto& message) {
        for (const auto& status : message->status)
          for (const auto& value : status.values) counted = value.key == "late commands" ? value.value : counted;
      });
  const ros::Publisher commands = commander(base);
  const std::string& name = ros::this_node::getName();
  wait_for("a count", [&] {
    commands.publish(twist(0.2, 0, 0));
    ros::WallDuration(0.05).sleep();
    ros::spinOnce();
    return counted.find(name) != std::string::npos;
  });
}

/// A node whose callbacks run in a thread of their own, with the odometry that it hears.
class SpinningNode {
 public:
  explicit SpinningNode(BaseClient& base) {
    node.setCallbackQueue(&queue_);
    subscriber_ = node.subscribe<nav_msgs::Odometry>(
        kOdometryTopic, 1, [this](const auto& message) { x = message->pose.pose.position.x; }, {},
        ros::TransportHints().tcpNoDelay());
    spinner_.start();
    wait_for("the base to be heard", [&] { return subscriber_.getNumPublishers() == 1; });
    go_by_the_clock(base);
  }
  ~SpinningNode() { spinner_.stop(); }

 private:
  ros::CallbackQueue queue_;
  ros::AsyncSpinner spinner_{1, &queue_};
  ros::Subscriber subscriber_;

 public:
  ros::NodeHandle node;
  std::atomic<double> x{0};  // by odometry, m
};

/// Where a timer of 30 Hz sees the base, which it drives.
std::vector<double> drive_by_timer(BaseClient& base) {
  const ros::Publisher commands = commander(base);
  std::vector<double> seen;
  std::atomic<bool> done{false};
  SpinningNode spinning(base);
  ros::Timer timer = spinning.node.createTimer(ros::Duration(1.0 / 30), [&](const ros::TimerEvent&) {
    done = seen.size() == 40;
    if (done) return;
    seen.push_back(spinning.x);
    commands.publish(towards(spinning.x));
  });
  wait_for("the timer", [&] { return done.load(); });
  timer.stop();
  return seen;
}

TEST(Lockstep, timer_in_a_spinners_thread_is_the_same_to_the_bit) {
  const std::vector<double> expected = drive_by_timer(BaseClient::fresh());
  EXPECT_GT(expected.back(), 0.1);
  EXPECT_EQ(drive_by_timer(BaseClient::fresh()), expected);
}

/// Where the base is when an action has driven it for a second, nm.
int drive_by_action(BaseClient& base) {
  const ros::Publisher commands = commander(base);
  SpinningNode spinning(base);
  using Server = actionlib::SimpleActionServer<actionlib::TestAction>;
  Server server(
      spinning.node, "drive",
      [&](const actionlib::TestGoalConstPtr& goal) {
        ros::Rate rate(goal->goal);
        for (int k = 0; k < goal->goal; ++k) {
          commands.publish(towards(spinning.x));
          rate.sleep();
        }
        actionlib::TestResult result;
        result.result = static_cast<int>(std::lround(1e9 * spinning.x));
        server.setSucceeded(result);
      },
      false);
  server.start();
  actionlib::SimpleActionClient<actionlib::TestAction> client("drive", true);
  EXPECT_TRUE(client.waitForServer(ros::Duration(20)));
  actionlib::TestGoal goal;
  goal.goal = 50;
  go_by_the_clock(base);
  client.sendGoal(goal);
  EXPECT_TRUE(client.waitForResult(ros::Duration(20)));
  return client.getResult()->result;
}

TEST(Lockstep, action_is_the_same_to_the_bit) {
  const int expected = drive_by_action(BaseClient::fresh());
  EXPECT_GT(expected, 100'000'000);
  EXPECT_EQ(drive_by_action(BaseClient::fresh()), expected);
}

/// Where the base and its wheels are while a loop drives it, which puts it elsewhere in between; and after how long, s.
std::vector<double> drive_and_set_state(BaseClient& base) {
  const ros::Publisher commands = commander(base);
  ros::NodeHandle node;
  nav_msgs::Odometry noted;
  const ros::Subscriber subscriber =
      node.subscribe<nav_msgs::Odometry>(kStateSetTopic, 10, [&](const auto& message) { noted = *message; });
  wait_for("the node to be heard", [&] { return subscriber.getNumPublishers() == 1; });
  go_by_the_clock(base);
  SetState put;
  put.request.pose.position.x = -0.1;
  put.request.pose.position.y = 0.7;
  put.request.pose.orientation.z = std::sin(0.3);
  put.request.pose.orientation.w = std::cos(0.3);
  put.request.twist.angular.z = 0.9;
  put.request.wheel_angles = {0.1, 0.2, 0.3, 0.4};
  std::vector<double> seen;
  ros::Rate rate(100);
  const ros::Time start = ros::Time::now();
  for (int k = 0; k < 30; ++k) {
    commands.publish(towards(base.truth.pose.pose.position.x));
    if (k == 10 && !call_service("base_node/set_state", put)) throw std::runtime_error("~set_state fails");
    rate.sleep();
    ros::spinOnce();
    const auto& [position, orientation] = base.truth.pose.pose;
    seen.insert(seen.end(), {position.x, position.y, orientation.z, orientation.w});
    seen.insert(seen.end(), base.joints.position.begin(), base.joints.position.end());
  }
  EXPECT_EQ(noted.pose.pose.position.x, put.request.pose.position.x);
  EXPECT_EQ(noted.pose.pose.position.y, put.request.pose.position.y);
  EXPECT_DOUBLE_EQ(noted.pose.pose.orientation.z, put.request.pose.orientation.z);
  EXPECT_DOUBLE_EQ(noted.pose.pose.orientation.w, put.request.pose.orientation.w);
  EXPECT_EQ(noted.twist.twist.angular.z, put.request.twist.angular.z);
  EXPECT_NEAR((noted.header.stamp - start).toSec(), 10 * kPeriod, 1e-8) << "at once";
  return seen;
}

TEST(Lockstep, state_that_is_set_is_the_same_to_the_bit) {
  const std::vector<double> expected = drive_and_set_state(BaseClient::fresh());
  EXPECT_GT(expected.end()[-7], 0.69) << "y";
  EXPECT_EQ(drive_and_set_state(BaseClient::fresh()), expected);
}

TEST(Lockstep, transforms_of_the_present_are_there) {
  BaseClient& base = BaseClient::fresh();
  const ros::Publisher commands = commander(base);
  tf2_ros::Buffer buffer;
  const tf2_ros::TransformListener listener(buffer);
  wait_for("a transform", [&] { return buffer.canTransform(kOdometryFrame, kBaseFrame, ros::Time(0)); });
  ros::Rate rate(100);
  for (int k = 0; k < 50; ++k) {
    commands.publish(twist(0.2, 0, 0));
    rate.sleep();
    ros::spinOnce();
    const auto transform = buffer.lookupTransform(kOdometryFrame, kBaseFrame, ros::Time::now());  // or throws
    EXPECT_EQ(transform.transform.translation.x, base.odometry.pose.pose.position.x);
  }
}

TEST(Lockstep, begins_without_a_command_where_it_is_told_to) {
  BaseClient& base = BaseClient::fresh();
  base.pause();
  base.unpause();
  const ros::Time begun = base.clock();
  wait_for("the clock to go on", [&] { return base.clock() > begun + ros::Duration(0.1); });
  base.pause();
  EXPECT_GT(base.step(0).t, 0.05) << "simulated";
  base.unpause();
}

TEST(Lockstep, clock_goes_on_before_the_first_command_and_the_base_does_not) {
  BaseClient& base = BaseClient::fresh();
  wait_for("the clock to go on", [&] { return base.time() > 2 * kPeriod; });
  base.settle();
  EXPECT_EQ(base.truth.header.stamp, base.clock());
  base.send(torque_message({1, 1, 1, 1}, {}));
  const ros::Time sent = base.clock();
  wait_for("the base to go", [&] { return base.truth.twist.twist.linear.x > 0; });
  base.settle();
  // v < a t, with the torques on 30 kg or more.
  EXPECT_LT(base.truth.twist.twist.linear.x, 4 / 0.05 / 30 * ((base.clock() - sent).toSec() + kPeriod));
}

/// Where the base is half a second after the first command, which takes `work` s of wall time to find.
std::vector<double> drive_after_work(BaseClient& base, double work) {
  const ros::Publisher commands = commander(base);
  const ros::Time begun = ros::Time::now();
  const auto end = ros::WallTime::now() + ros::WallDuration(work);
  while (ros::WallTime::now() < end) continue;
  EXPECT_EQ(ros::Time::now(), begun) << "time waits";
  commands.publish(twist(0.2, 0, 0));
  (begun + ros::Duration(0.5) - ros::Time::now()).sleep();
  ros::spinOnce();
  return {base.odometry.pose.pose.position.x, base.truth.pose.pose.position.x};
}

TEST(Lockstep, first_command_acts_at_once_however_long_it_takes_to_find) {
  const std::vector<double> expected = drive_after_work(BaseClient::fresh(), 0);
  EXPECT_GT(expected.back(), 0.05);
  EXPECT_EQ(drive_after_work(BaseClient::fresh(), 0.5), expected);
}

// The command is forgotten with all else: a reset that comes while the node waits for its followers to rest does not
// begin the simulation with it.
TEST(Lockstep, reset_forgets_a_command_that_has_just_come) {
  BaseClient& base = BaseClient::fresh();
  for (int k = 0; k < 5; ++k) {
    base.send(torque_message({1, 1, 1, 1}, {}));
    base.reset();
  }
  wait_for("the clock to go on", [&] { return base.time() > 2 * kPeriod; });
  base.pause();
  Step step;
  EXPECT_TRUE(call_service("base_node/step", step));
  EXPECT_EQ(step.response.t, 0) << "nothing was simulated";
  base.unpause();
}

}  // namespace
}  // namespace youbot_base_sim

int main(int argc, char** argv) { return youbot_base_sim::run_rostest(argc, argv); }
