// Commands with every kind of wrong entry: what is refused is complained about in one line, and the base goes on as if
// it had not come.

#include <gtest/gtest.h>

#include <limits>

#include "joint_entry.h"
#include "promises/refusals.h"
#include "youbot_base_sim/loop/base_loop.h"
#include "youbot_base_sim/ros/conversions.h"

namespace youbot_base_sim {
namespace {

const double kNoNumbers[] = {kNan, -kNan, kInf, -kInf};

std::vector<std::string> wrong_units(const std::string& right, const std::string& other) {
  return {"",         other, right + " ",  " " + right,        right.substr(1),
          "rad s^-1", "Nm",  right + "\n", "\033[31m" + right, std::string(100000, 'u')};
}

/// Expects that no wheel has a set point, and one complaint that may be logged.
void expect_refused(const WheelCommand& command) {
  for (const auto& set_point : command.set_points) EXPECT_FALSE(set_point);
  ASSERT_EQ(command.complaints.size(), 1u);
  expect_refusal(command.complaints[0].text, {});
  expect_refusal(command.complaints[0].subject, {});
}

template <class Message>
struct Entries;
template <>
struct Entries<brics_actuator::JointTorques> {
  static constexpr const char* kUnit = kTorqueUnit;
  static constexpr const char* kOther = kVelocityUnit;
  static auto& of(brics_actuator::JointTorques& message) { return message.torques; }
};
template <>
struct Entries<brics_actuator::JointVelocities> {
  static constexpr const char* kUnit = kVelocityUnit;
  static constexpr const char* kOther = kTorqueUnit;
  static auto& of(brics_actuator::JointVelocities& message) { return message.velocities; }
};

template <class Message>
class JointCommandTest : public testing::Test {
 protected:
  static Message of(std::vector<brics_actuator::JointValue> values) {
    Message message;
    Entries<Message>::of(message) = std::move(values);
    return message;
  }
};
using Messages = testing::Types<brics_actuator::JointTorques, brics_actuator::JointVelocities>;
TYPED_TEST_SUITE(JointCommandTest, Messages, );

TYPED_TEST(JointCommandTest, RefusesWhatIsNoCommand) {
  using E = Entries<TypeParam>;
  int cases = 0;
  for (int i = 0; i < kWheels; ++i) {
    for (const double value : kNoNumbers) {
      expect_refused(wheel_command(this->of({entry(wheel_joint(i), E::kUnit, value)})));
      ++cases;
    }
    for (const std::string& unit : wrong_units(E::kUnit, E::kOther)) {
      expect_refused(wheel_command(this->of({entry(wheel_joint(i), unit, 1)})));
      ++cases;
    }
  }
  expect_refused(wheel_command(TypeParam()));
  EXPECT_GE(cases, 50);
}

TYPED_TEST(JointCommandTest, TakesTheGoodEntriesBesideTheBad) {
  using E = Entries<TypeParam>;
  for (const double value : kNoNumbers) {
    for (const std::string& unit : wrong_units(E::kUnit, E::kOther)) {
      const WheelCommand command =
          wheel_command(this->of({entry("wheel_joint_fl", E::kUnit, value), entry("wheel_joint_fr", unit, 1),
                                  entry("arm_joint_1", unit, value), entry(std::string(1000, 'j'), E::kUnit, 1),
                                  entry("wheel_joint_br", E::kUnit, 0.5)}));
      EXPECT_FALSE(command.set_points[0] || command.set_points[1] || command.set_points[2]);
      ASSERT_TRUE(command.set_points[3]);
      EXPECT_EQ(command.set_points[3]->value, 0.5);
      EXPECT_EQ(command.complaints.size(), 2u);
      for (const Complaint& complaint : command.complaints) expect_refusal(complaint.text, {});
    }
  }
}

geometry_msgs::Twist twist(double x, double y, double turn) {
  geometry_msgs::Twist message;
  message.linear.x = x;
  message.linear.y = y;
  message.angular.z = turn;
  return message;
}

TEST(TwistTest, RefusesWhatIsNoVelocity) {
  for (const double value : kNoNumbers) {
    expect_refused(wheel_command(twist(value, 0, 0), {}));
    expect_refused(wheel_command(twist(0, value, 0), {}));
    expect_refused(wheel_command(twist(0, 0, value), {}));
  }
}

// However large: the motors' limits come later.
TEST(TwistTest, MakesRatesThatAreNumbers) {
  const double huge = std::numeric_limits<double>::max();
  for (const double x : {-huge, 0.0, huge}) {
    for (const double y : {-huge, 0.0, huge}) {
      for (const double turn : {-huge, 0.0, huge}) {
        SCOPED_TRACE(testing::Message() << x << ", " << y << ", " << turn);
        for (const auto& set_point : wheel_command(twist(x, y, turn), {}).set_points) {
          EXPECT_TRUE(!set_point || std::isfinite(set_point->value)) << set_point->value;
        }
      }
    }
  }
}

LoopSettings settings() {
  LoopSettings settings;
  settings.scene.solver.control_period = 1e-3;
  return settings;
}

// The largest that messages can carry, one after the other: clipped, and the motion is finite.
TEST(BaseLoopTest, GoesOnWithTheLargestCommands) {
  BaseLoop loop(settings());
  for (const double size : {1e3, 1e10, 1e100, 1e308}) {
    for (const double sign : {1.0, -1.0}) {
      const double value = sign * size;
      loop.push(loop.time(), wheel_command(torque_message({value, -value, value, value}, ros::Time())).set_points);
      loop.advance_periods(5);
      loop.push(loop.time(), wheel_command(velocity_message({value, -value, value, value}, ros::Time())).set_points);
      loop.advance_periods(5);
      loop.push(loop.time(), wheel_command(twist(value, -value, value), {}).set_points);
      loop.advance_periods(5);
      ASSERT_TRUE(loop.simulation().state().values.allFinite());
      EXPECT_LE(loop.simulation().torque().abs().maxCoeff(), 3.1);
    }
  }
}

// Nothing of what is refused reaches the base: it stays where it was held, to the last bit.
TEST(BaseLoopTest, GoesOnAsIfNothingHadCome) {
  const auto end = [](bool disturbed) {
    BaseLoop loop(settings());
    loop.push(0, wheel_command(velocity_message({3, 4, -2, 3}, ros::Time())).set_points);
    for (int k = 0; k < 100; ++k) {
      if (disturbed) {
        const double value = kNoNumbers[k % 4];
        loop.push(loop.time(), wheel_command(torque_message({value, value, value, value}, ros::Time())).set_points);
        loop.push(loop.time(), wheel_command(twist(value, 0, 0), {}).set_points);
        loop.push(loop.time(), wheel_command(brics_actuator::JointVelocities()).set_points);
      }
      loop.advance_periods(1);
    }
    return loop.simulation().state();
  };
  EXPECT_TRUE((end(true).values == end(false).values).all());
}

}  // namespace
}  // namespace youbot_base_sim
