// /diagnostics says the driver's words about the base, and our own about the simulation.

#include <diagnostic_msgs/DiagnosticArray.h>

#include "base_client.h"
#include "youbot_base_sim/integration/statistics.h"

namespace youbot_base_sim {
namespace {

using diagnostic_msgs::DiagnosticStatus;

class Diagnostics : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    static ros::NodeHandle node;
    static const ros::Subscriber subscriber = node.subscribe("/diagnostics", 100, &Diagnostics::take);
    BaseClient& base = BaseClient::fresh();
    base.wait_for("diagnostics", [&] {
      base.idle(1);
      return !latest_.status.empty();
    });
  }

  /// The status of this name in the message of simulated time t, which is a multiple of 2 s.
  DiagnosticStatus status(double t, const std::string& name) {
    while (base_.time() < t) base_.idle(1);
    base_.wait_for("diagnostics", [&] { return latest_.header.stamp == stamp_of(t); });
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
    expect(status(t, "platform_Arm"), DiagnosticStatus::ERROR, "arm is not connected or switched off");
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
  EXPECT_TRUE(base_.call("base/switchOffMotors"));
  EXPECT_EQ(value(status(4.0, "youbot_base_sim: wheels"), "wheel_joint_fl").rfind("motor off, on roller ", 0), 0u);
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
