// Torques played over the topic do to the node what they do to a simulation in this process.

#include "base_client.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

constexpr double kTolerance = 1e-9;

Scene case_2() {
  Scene scene = load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case2.yaml");
  scene.solver.control_period = 1e-3;
  return scene;
}

class TorquesCommand : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const Scene scene = case_2();
    Simulation simulation(scene);
    simulation.advance_to(3.0);
    expected_ = simulation.state();
    expected_switches_ = simulation.take_switches();
    for (int i = 0; i < kWheels; ++i) {
      for (int k = 0; k < scene.robot.rollers; ++k) expected_rollers_.push_back(simulation.roller_angle(i, k));
    }
    base_ = &BaseClient::fresh();
    const auto torque = make_torque_profile(scene);
    for (int k = 0; k < 3000; ++k) {
      torque->begin_segment(base_->time());
      base_->command(torque_message(torque->value(base_->time()), base_->clock()));
    }
    base_->settle();
  }

  static State expected_;
  static std::vector<RollerSwitch> expected_switches_;
  static std::vector<double> expected_rollers_;
  static BaseClient* base_;
};

State TorquesCommand::expected_;
std::vector<RollerSwitch> TorquesCommand::expected_switches_;
std::vector<double> TorquesCommand::expected_rollers_;
BaseClient* TorquesCommand::base_;

TEST_F(TorquesCommand, take_three_seconds) { EXPECT_EQ(base_->time(), 3.0); }

TEST_F(TorquesCommand, end_at_the_same_pose) {
  EXPECT_EQ(base_->truth.header.frame_id, "world");
  EXPECT_EQ(base_->truth.child_frame_id, "base_footprint");
  EXPECT_NEAR(base_->truth.pose.pose.position.x, expected_.x(), kTolerance);
  EXPECT_NEAR(base_->truth.pose.pose.position.y, expected_.y(), kTolerance);
  EXPECT_NEAR(heading(base_->truth.pose.pose.orientation), expected_.psi(), kTolerance);
}

TEST_F(TorquesCommand, end_at_the_same_velocity) {
  EXPECT_NEAR(base_->truth.twist.twist.linear.x, expected_.V_X(), kTolerance);
  EXPECT_NEAR(base_->truth.twist.twist.linear.y, expected_.V_Y(), kTolerance);
  EXPECT_NEAR(base_->truth.twist.twist.angular.z, expected_.Omega(), kTolerance);
}

TEST_F(TorquesCommand, end_with_the_same_wheels) {
  const std::vector<std::string> names = {"wheel_joint_fl",  "wheel_joint_fr",  "wheel_joint_bl",  "wheel_joint_br",
                                          "caster_joint_fl", "caster_joint_fr", "caster_joint_bl", "caster_joint_br"};
  ASSERT_EQ(base_->joints.name.size(), 8 + expected_rollers_.size());
  for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(base_->joints.name[i], names[i]);
  for (int i = 0; i < kWheels; ++i) {
    EXPECT_NEAR(base_->joints.position[i], expected_.phi()[i], kTolerance);
    EXPECT_NEAR(base_->joints.velocity[i], expected_.dphi()[i], kTolerance);
    EXPECT_EQ(base_->joints.position[kWheels + i], 0) << "caster";
  }
}

TEST_F(TorquesCommand, end_with_the_same_rollers) {
  ASSERT_EQ(base_->joints.name.size(), 8 + expected_rollers_.size());
  EXPECT_EQ(base_->joints.name[8], "roller_joint_fl_0");
  EXPECT_EQ(base_->joints.name.back(), "roller_joint_br_5");
  for (std::size_t k = 0; k < expected_rollers_.size(); ++k) {
    EXPECT_NEAR(base_->joints.position[8 + k], expected_rollers_[k], 1e-7) << base_->joints.name[8 + k];
  }
}

TEST_F(TorquesCommand, pass_the_same_switches) {
  base_->wait_for("all switches", [&] { return base_->switches.size() >= expected_switches_.size(); });
  ASSERT_EQ(base_->switches.size(), expected_switches_.size());
  for (std::size_t k = 0; k < expected_switches_.size(); ++k) {
    const RollerSwitch& expected = expected_switches_[k];
    const RollerSwitchStamped& published = base_->switches[k];
    EXPECT_NEAR(published.t, expected.t, kTolerance);
    EXPECT_EQ(published.header.stamp, stamp_of(published.t));
    EXPECT_EQ(published.wheel, wheel_joint(expected.wheel));
    EXPECT_EQ(published.roller_from, expected.roller_from);
    EXPECT_EQ(published.roller_to, expected.roller_to);
    EXPECT_EQ(published.direction, expected.direction);
  }
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
