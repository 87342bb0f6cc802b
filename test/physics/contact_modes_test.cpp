// Which contact each wheel has, and how that changes.

#include "youbot_base_sim/physics/contact_modes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace youbot_base_sim {
namespace {

struct ContactModesTest : testing::Test {
  RobotParameters robot;  // n = 6
  RollerGeometry geometry{robot};
  const double pitch = geometry.pitch();
  ContactModes modes{robot, {0, 0.6 * pitch, -0.6 * pitch, 7 * pitch}};
};

TEST_F(ContactModesTest, WheelsBeginOnTheRollersAtTheirAngles) {
  const std::int64_t rollers[] = {0, 1, -1, 7};
  for (int i = 0; i < kWheels; ++i) {
    EXPECT_EQ(modes.roller(i), rollers[i]);
    EXPECT_TRUE(modes.on_one_roller(i));
    EXPECT_EQ(modes.lower_edge()[i], geometry.upper_edge(rollers[i] - 1));
    EXPECT_EQ(modes.upper_edge()[i], geometry.upper_edge(rollers[i]));
    EXPECT_EQ(modes.center()[i], static_cast<double>(rollers[i]) * pitch);
  }
  EXPECT_FALSE(modes.mixed());
  EXPECT_EQ(modes.rollers(), robot.rollers);
}

TEST_F(ContactModesTest, RollersKeepTheAngleWithWhichTheyLeaveTheFloor) {
  State x;
  x.gamma() << 1, 2, 3, 4;
  x.dgamma() << 5, 6, 7, 8;
  modes.switch_roller(0, 1, x);
  EXPECT_EQ(modes.roller(0), 1);
  EXPECT_EQ(modes.angle_off_floor(0, 0), 1);
  EXPECT_EQ(x.gamma()[0], 0);  // as roller 1 was before the motion
  EXPECT_EQ(x.dgamma()[0], 5);
  x.gamma()[0] = 0.5;
  modes.switch_roller(0, 6, x);  // the same roller as 0
  EXPECT_EQ(modes.angle_off_floor(0, 1), 0.5);
  EXPECT_EQ(x.gamma()[0], 1);
  EXPECT_EQ(x.work(), 0);
  EXPECT_TRUE((x.gamma().tail<3>() == Eigen::Array3d{2, 3, 4}).all());
}

TEST_F(ContactModesTest, ARollerThatStartsAtRestLeavesTheEnergyOfTheOneBefore) {
  robot.roller_rate_at_switch = RollerRateAtSwitch::kAtRest;
  modes = ContactModes(robot, Wheels::Zero());
  State x;
  x.dgamma() << 5, 6, 7, 8;
  modes.switch_roller(2, -1, x);
  EXPECT_TRUE((x.dgamma() == Wheels{5, 6, 0, 8}).all());
  EXPECT_EQ(x.work(), -0.5 * robot.J_2 * 49);
}

TEST_F(ContactModesTest, SharedAndAveragedContactsHaveNoEdges) {
  modes.share(1, 1);
  modes.enter_averaging(3);
  EXPECT_TRUE(modes.shares() && modes.averages() && modes.mixed());
  EXPECT_TRUE((modes.shared() == WheelMask{false, true, false, false}).all());
  EXPECT_TRUE(modes.averaged(3) && !modes.averaged(1));
  EXPECT_FALSE(modes.on_one_roller(1) || modes.on_one_roller(3));
  EXPECT_EQ(modes.lower_roller(1), 1);
  for (const int i : {1, 3}) {
    EXPECT_EQ(modes.lower_edge()[i], -kInfinity);
    EXPECT_EQ(modes.upper_edge()[i], kInfinity);
  }
  modes.set_roller(1, 2);
  EXPECT_FALSE(modes.shares());
  EXPECT_TRUE(modes.averages());
  modes.set_roller(3, 7);
  EXPECT_FALSE(modes.mixed());
  EXPECT_TRUE(modes.on_one_roller(1) && modes.on_one_roller(3));
}

TEST_F(ContactModesTest, TheShapeOfAnAveragedContactIsTheMean) {
  modes.enter_averaging(3);
  const Wheels phi = {0.1, 0.7 * pitch, -0.5 * pitch, 123.4};
  const ContactGeometry g = modes.geometry(phi), one = geometry.at({0.1, -0.3 * pitch, 0.5 * pitch, 0});
  EXPECT_EQ(modes.phi_tilde(phi)[3], 0);
  for (Wheels ContactGeometry::*entry :
       {&ContactGeometry::Delta_Y, &ContactGeometry::r_X, &ContactGeometry::r_Y, &ContactGeometry::dr_Y}) {
    for (int i = 0; i < 3; ++i) EXPECT_NEAR((g.*entry)[i], (one.*entry)[i], 1e-14) << i;
    EXPECT_EQ((g.*entry)[3], (geometry.mean().*entry)[3]);
  }
}

TEST_F(ContactModesTest, RatesOfAveragingAndBackLeaveAGap) {
  State x;
  const double limit = kMaxLocatedRate * pitch;
  for (const double rate : {0.79, 0.81, 0.99, 1.01}) {
    x.dphi()[0] = -rate * limit;
    EXPECT_EQ(modes.above_location_limit(0, x), rate > 1) << rate;
    EXPECT_EQ(modes.below_resolution_limit(0, x) > 0, rate < 0.8) << rate;
  }
  modes.enter_averaging(0);
  x.phi()[0] = -12.4 * pitch;
  modes.track_roller(0, x);
  EXPECT_EQ(modes.roller(0), -12);
}

TEST_F(ContactModesTest, EachChangeHasAnIdOfItsOwn) {
  State x;
  ContactModes::Ids last = modes.ids();
  const auto changed = [&] {
    const WheelMask result = modes.ids() != last;
    last = modes.ids();
    return result[2] && !result[0] && !result[1] && !result[3];
  };
  modes.switch_roller(2, 0, x);
  EXPECT_TRUE(changed());
  modes.share(2, 0);
  EXPECT_TRUE(changed());
  modes.set_roller(2, 0);
  EXPECT_TRUE(changed());
  modes.enter_averaging(2);
  EXPECT_TRUE(changed());
}

TEST_F(ContactModesTest, AWheelIsKeptInsideItsRange) {
  State x;
  for (const double phi : {-1.0, 0.0, 1.0, geometry.upper_edge(0)}) {
    x.phi()[0] = phi;
    modes.keep_inside(0, x);
    EXPECT_GE(x.phi()[0], modes.lower_edge()[0]);
    EXPECT_LT(x.phi()[0], modes.upper_edge()[0]);
    if (phi == 0) {
      EXPECT_EQ(x.phi()[0], 0);
    }
  }
  EXPECT_EQ(modes.roller_at(ContactModes::far_side(geometry.upper_edge(4), +1)), 5);
  EXPECT_EQ(modes.roller_at(ContactModes::far_side(geometry.upper_edge(4), -1)), 4);
}

}  // namespace
}  // namespace youbot_base_sim
