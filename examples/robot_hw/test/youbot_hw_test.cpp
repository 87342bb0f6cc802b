// The interfaces of ros_control, used as controllers and their manager do.

#include "youbot_robot_hw/youbot_hw.h"

#include <gtest/gtest.h>
#include <ros/time.h>

#include <limits>
#include <set>

namespace youbot_robot_hw {
namespace {

using hardware_interface::ControllerInfo;
using hardware_interface::EffortJointInterface;
using hardware_interface::JointStateInterface;
using hardware_interface::VelocityJointInterface;

const char* const kJoints[] = {"wheel_joint_fl", "wheel_joint_fr", "wheel_joint_bl", "wheel_joint_br"};
const ros::Duration kPeriod(0.01);

youbot_base_sim::Scene scene() {
  return youbot_base_sim::default_scene({{"solver.control_period", 1e-3}, {"robot.profile", "measured"}});
}

ControllerInfo controller(const std::string& name, const std::string& interface) {
  ControllerInfo info;
  info.name = name;
  info.claimed_resources.emplace_back(interface, std::set<std::string>(std::begin(kJoints), std::end(kJoints)));
  return info;
}

const ControllerInfo kByVelocity = controller("by_velocity", "hardware_interface::VelocityJointInterface");
const ControllerInfo kByEffort = controller("by_effort", "hardware_interface::EffortJointInterface");

struct YoubotHWTest : testing::Test {
  YoubotHW hardware{scene()};

  template <class Interface>
  void command(double value) {
    for (const char* joint : kJoints) hardware.get<Interface>()->getHandle(joint).setCommand(value);
  }
  double velocity(const char* joint) { return hardware.get<JointStateInterface>()->getHandle(joint).getVelocity(); }
  double effort(const char* joint) { return hardware.get<JointStateInterface>()->getHandle(joint).getEffort(); }
  void run(double duration) {
    for (int k = 0; k < duration / kPeriod.toSec(); ++k) {
      hardware.read({}, kPeriod);
      hardware.write({}, kPeriod);
    }
    hardware.read({}, kPeriod);
  }
};

TEST_F(YoubotHWTest, WheelsThatNobodyClaimsRest) {
  command<VelocityJointInterface>(5);
  command<EffortJointInterface>(2);
  run(1);
  EXPECT_NEAR(hardware.base().state().x(), 0, 1e-4);
}

TEST_F(YoubotHWTest, WheelsObeyTheInterfaceOfTheirController) {
  hardware.doSwitch({kByVelocity}, {});
  command<VelocityJointInterface>(5);
  command<EffortJointInterface>(-2);
  run(2);
  for (const char* joint : kJoints) EXPECT_NEAR(velocity(joint), 5, 0.5) << joint;

  hardware.doSwitch({kByEffort}, {kByVelocity});
  run(0.02);
  for (const char* joint : kJoints) EXPECT_EQ(effort(joint), 0) << joint << ": a switch clears the command";
  command<EffortJointInterface>(-1);
  run(2);
  for (const char* joint : kJoints) {
    EXPECT_NEAR(effort(joint), -1, 1e-3) << joint;
    EXPECT_LT(velocity(joint), 0) << joint;
  }

  hardware.doSwitch({}, {kByEffort});
  run(3);
  for (const char* joint : kJoints) EXPECT_NEAR(velocity(joint), 0, 0.05) << joint;
}

TEST_F(YoubotHWTest, WheelsHaveOneController) {
  EXPECT_TRUE(hardware.checkForConflict({kByVelocity, kByEffort}));
  EXPECT_FALSE(hardware.checkForConflict({kByVelocity}));
}

TEST_F(YoubotHWTest, CommandsThatAreNotFiniteChangeNothing) {
  ros::Time::init();  // for the warning
  hardware.doSwitch({kByVelocity}, {});
  command<VelocityJointInterface>(5);
  run(2);
  command<VelocityJointInterface>(std::numeric_limits<double>::quiet_NaN());
  run(1);
  for (const char* joint : kJoints) EXPECT_NEAR(velocity(joint), 5, 0.5) << joint;
}

}  // namespace
}  // namespace youbot_robot_hw

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
