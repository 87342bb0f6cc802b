// What the node says of the base: contacts, diagnostics, transforms, and that it tips over.

#include <diagnostic_msgs/DiagnosticArray.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>
#include <visualization_msgs/MarkerArray.h>
#include <youbot_base_sim/ContactsStamped.h>

#include "log.h"
#include "youbot_base_sim/integration/statistics.h"

namespace youbot_base_sim {
namespace {

// The powers on the topic `contacts` are those of the motion. Time starts without a subscriber: BaseClient has none.
TEST(ContactsTopic, tells_who_subscribes_what_drives_the_base) {
  BaseClient& base = BaseClient::fresh();
  ros::NodeHandle node;
  ContactsStamped latest;
  const ros::Subscriber subscriber = node.subscribe<ContactsStamped>(
      "contacts", 1000, [&](const auto& message) { latest = *message; }, {}, ros::TransportHints().tcpNoDelay());
  wait_for("the connection", [&] { return subscriber.getNumPublishers() == 1; });
  const auto advance = [&] {
    base.command(twist(0.2, 0.1, 0.3));
    wait_for("the contacts of the present time", [&] { return latest.header.stamp == base.clock(); });
  };
  // Each millisecond of the start, in which the base gains what the drives put in and nothing else takes.
  advance();
  const double energy_before = latest.kinetic_energy;
  double work = -latest.drive_power / 2 * 1e-3, taken = 0;
  for (int k = 0; k < 200; ++k) {
    advance();
    ASSERT_EQ(latest.contacts.size(), 4u);
    EXPECT_EQ(latest.contacts[2].wheel, "wheel_joint_bl");
    work += 1e-3 * latest.drive_power;
    taken += 1e-3 * (latest.bearing_power + latest.roller_power + latest.floor_power);
  }
  const double gained = latest.kinetic_energy - energy_before;
  EXPECT_GT(gained, 0.3);
  EXPECT_GT(taken, 0);
  EXPECT_NEAR(work - taken, gained, 0.05 * work);
}

using diagnostic_msgs::DiagnosticStatus;

/// /diagnostics says the driver's words about the base, and our own about the simulation.
class Diagnostics : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    static ros::NodeHandle node;
    static const ros::Subscriber subscriber = node.subscribe("/diagnostics", 100, &Diagnostics::take);
    BaseClient& base = BaseClient::fresh();
    wait_for("diagnostics", [&] {
      base.idle(1);
      return !latest_.status.empty();
    });
  }

  /// The status of this name in the message of simulated time t, which is a multiple of 2 s.
  DiagnosticStatus status(double t, const std::string& name) {
    while (base_.time() < t) base_.idle(1);
    wait_for("diagnostics", [&] { return latest_.header.stamp == stamp_of(t); });
    for (const DiagnosticStatus& status : latest_.status) {
      if (status.name == name) return status;
    }
    throw std::runtime_error(name + " is not there");
  }

  static std::string value(const DiagnosticStatus& status, const std::string& key) {
    for (const auto& pair : status.values) {
      if (pair.key == key) return pair.value;
    }
    throw std::runtime_error(key + " is not there");
  }

  /// The key of a field of the statistics.
  static std::string text_of(std::uint64_t IntegrationStatistics::*value) {
    for (const StatisticsField& field : kStatisticsFields) {
      if (field.value == value) return field.text;
    }
    throw std::runtime_error("no such field");
  }

  static void take(const diagnostic_msgs::DiagnosticArray::ConstPtr& message) { latest_ = *message; }

  static void expect(const DiagnosticStatus& status, int level, const std::string& message) {
    EXPECT_EQ(status.level, level) << status.name;
    EXPECT_EQ(status.message, message) << status.name;
  }

  static diagnostic_msgs::DiagnosticArray latest_;
  BaseClient& base_ = BaseClient::fresh();
};

diagnostic_msgs::DiagnosticArray Diagnostics::latest_;

TEST_F(Diagnostics, are_the_drivers_every_two_seconds) {
  for (const double t : {2.0, 4.0}) {
    expect(status(t, "platform_Base"), DiagnosticStatus::OK, "base is present");
    expect(status(t, "platform_Arm"), DiagnosticStatus::OK, "arm is not connected or switched off");
    expect(status(t, "platform_EtherCAT"), DiagnosticStatus::OK, "EtherCAT connnection is established");
  }
  EXPECT_EQ(latest_.status[0].name, "platform_Base");
  EXPECT_EQ(latest_.status[1].name, "platform_Arm");
  EXPECT_EQ(latest_.status[2].name, "platform_EtherCAT");
}

TEST_F(Diagnostics, tell_of_a_lost_base) {
  SetFaults::Request lost;
  lost.ethercat_lost = true;
  base_.set_faults(lost);
  expect(status(2.0, "platform_Base"), DiagnosticStatus::ERROR, "base is not connected or switched off");
  expect(status(2.0, "platform_EtherCAT"), DiagnosticStatus::ERROR, "EtherCAT connnection lost");
  EXPECT_EQ(value(status(2.0, "youbot_base_sim: faults"), "EtherCAT"), "lost");
}

TEST_F(Diagnostics, count_what_the_integration_did) {
  base_.command(twist(0.4, 0, 0));
  const DiagnosticStatus integration = status(2.0, "youbot_base_sim: integration");
  expect(integration, DiagnosticStatus::OK, "accurate");
  EXPECT_GT(std::stoi(value(integration, text_of(&IntegrationStatistics::steps))), 2000);
  // 0.84 m at 0.05 m of radius and six rollers: 16 a wheel.
  EXPECT_NEAR(std::stoi(value(integration, text_of(&IntegrationStatistics::switches))), 64, 8);
  EXPECT_EQ(value(integration, text_of(&IntegrationStatistics::fallback_steps)), "0");
  for (const StatisticsField& field : kStatisticsFields) EXPECT_NE(value(integration, field.text), "") << field.name;
}

TEST_F(Diagnostics, tell_what_the_wheels_do) {
  base_.command(torque_message({0.5, 0, 0, 0}, {}));
  const DiagnosticStatus wheels = status(2.0, "youbot_base_sim: wheels");
  EXPECT_EQ(value(wheels, "wheel_joint_fl").rfind("torque 0.5 N m, on roller ", 0), 0u);
  EXPECT_EQ(value(wheels, "wheel_joint_fl set point (N m or rad/s)"), "0.5");
  EXPECT_LT(std::stoi(value(wheels, "wheel_joint_fl roller")), 6);
  EXPECT_TRUE(base_.call("base/switchOffMotors"));
  EXPECT_EQ(value(status(4.0, "youbot_base_sim: wheels"), "wheel_joint_fl").rfind("motor off, on roller ", 0), 0u);
}

void expect_same(const geometry_msgs::Transform& transform, const geometry_msgs::Pose& pose, double tolerance) {
  EXPECT_NEAR(transform.translation.x, pose.position.x, tolerance);
  EXPECT_NEAR(transform.translation.y, pose.position.y, tolerance);
  EXPECT_NEAR(transform.translation.z, pose.position.z, tolerance);
  EXPECT_NEAR(std::remainder(heading(transform.rotation) - heading(pose.orientation), 2 * M_PI), 0, tolerance);
}

// TF says what the topics say.
TEST(Transforms, agree_with_the_topics) {
  tf2_ros::Buffer buffer;
  tf2_ros::TransformListener listener(buffer);
  BaseClient& base = BaseClient::fresh();
  const auto lookup = [&](const std::string& frame) {
    wait_for("the transform", [&] { return buffer.canTransform(frame, "base_footprint", base.clock()); });
    return buffer.lookupTransform(frame, "base_footprint", base.clock()).transform;
  };

  // At the start odometry lies over ground truth.
  expect_same(lookup("world"), base.truth.pose.pose, 1e-12);
  expect_same(lookup("odom"), base.odometry.pose.pose, 1e-12);
  EXPECT_EQ(base.odometry.pose.pose.position.x, 0);
  EXPECT_EQ(base.truth.pose.pose.position.x, 2.5);

  geometry_msgs::Twist twist;
  twist.linear.x = 0.2;
  twist.linear.y = -0.1;
  twist.angular.z = 0.4;
  for (int k = 0; k < 300; ++k) {
    base.command(twist);
    if (k % 30 != 29) continue;
    base.settle();
    expect_same(lookup("odom"), base.odometry.pose.pose, 1e-12);
    wait_for("the truth", [&] { return buffer.canTransform("world", "ground_truth/base_footprint", base.clock()); });
    expect_same(buffer.lookupTransform("world", "ground_truth/base_footprint", base.clock()).transform,
                base.truth.pose.pose, 1e-12);
  }
  EXPECT_GT(base.odometry.pose.pose.position.x, 0.02);
}

using visualization_msgs::Marker;

// A push tips the base over its side: the node goes on, and says so in its log, in /diagnostics and in rviz.
TEST(TippingBase, is_an_error_while_it_tips_and_a_warning_afterwards) {
  Log& log = Log::of(BaseClient::fresh());
  BaseClient& base = BaseClient::fresh();  // time has gone on meanwhile, perhaps to the limit
  ros::NodeHandle node;
  diagnostic_msgs::DiagnosticArray diagnostics;
  visualization_msgs::MarkerArray markers;
  const std::vector<ros::Subscriber> subscribers = {
      node.subscribe<diagnostic_msgs::DiagnosticArray>("/diagnostics", 100,
                                                       [&](const auto& message) { diagnostics = *message; }),
      node.subscribe<visualization_msgs::MarkerArray>("contact_markers", 100,
                                                      [&](const auto& message) { markers = *message; })};
  wait_for("the connections",
           [&] { return subscribers[0].getNumPublishers() == 1 && subscribers[1].getNumPublishers() == 1; });
  const auto reactions_at = [&](double t) {
    while (base.time() < t) base.idle(1);
    wait_for("diagnostics", [&] { return diagnostics.header.stamp == stamp_of(t); });
    for (const DiagnosticStatus& status : diagnostics.status) {
      if (status.name == "youbot_base_sim: normal reactions") return status;
    }
    throw std::runtime_error("no status of the normal reactions");
  };
  const auto marker = [&](const std::string& ns, int id) {
    wait_for("markers", [&] { return !markers.markers.empty() && markers.markers[0].header.stamp == base.clock(); });
    for (const Marker& one : markers.markers) {
      if (one.ns == ns && one.id == id) return one;
    }
    throw std::runtime_error("no marker " + ns);
  };

  while (base.time() < 1) base.idle(1);
  EXPECT_EQ(marker("status", 1).action, Marker::DELETE);
  EXPECT_EQ(marker("off_floor", 1).action, Marker::DELETE);

  const DiagnosticStatus during = reactions_at(2);
  log.expect(rosgraph_msgs::Log::ERROR, {"the base tips over at t = 1.5", "left side", "goes on"});
  EXPECT_EQ(during.level, DiagnosticStatus::ERROR);
  EXPECT_EQ(during.message, "the base is at its tipping limit, on the wheels of the left side");
  EXPECT_EQ(marker("status", 1).text, "TIPPING: the wheels of the left side carry all");
  for (const int right : {1, 3}) EXPECT_EQ(marker("off_floor", right).text, "off the floor");
  for (const int left : {0, 2}) EXPECT_EQ(marker("off_floor", left).action, Marker::DELETE);

  const DiagnosticStatus after = reactions_at(4);
  EXPECT_EQ(after.level, DiagnosticStatus::WARN);
  EXPECT_EQ(after.message, "the base was at its tipping limit, on the wheels of the left side");
  for (const auto& pair : after.values) {
    if (pair.key == "at the tipping limit") {
      EXPECT_NEAR(std::stod(pair.value), 1.5, 0.05);
    }
  }
  EXPECT_EQ(marker("status", 1).action, Marker::DELETE);
}

}  // namespace
}  // namespace youbot_base_sim

int main(int argc, char** argv) { return youbot_base_sim::run_rostest(argc, argv); }
