// Twins: robots that are known are found again from what their bags would tell, and records that are not what they
// should be are found and named.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "twin.h"
#include "youbot_base_sim/identify/first_guess.h"
#include "youbot_base_sim/identify/fit.h"
#include "youbot_base_sim/identify/forward_model.h"

namespace youbot_base_sim {
namespace {

double value(const Scene& scene, const char* key) { return parameters()[parameter(key)].get(scene); }

/// Half a minute of what identification_drive.launch drives: every third motion is held out.
const std::vector<Command> kDrive = {
    {0.5, {0, 0, 0}},      {1.6, {0.1, 0, 0}},  {1.6, {-0.25, 0, 0}}, {1.2, {0.1, 0, 0}},     {0.5, {0, 0, 0}},
    {1.9, {0, 0.1, 0}},    {1.9, {0, -0.2, 0}}, {1.5, {0, 0.1, 0}},   {1.0, {0, 0, 0}},       {1.8, {0, 0, 0.3}},
    {1.8, {0, 0, -0.8}},   {1.5, {0, 0, 0.5}},  {1.0, {0, 0, 0}},     {1.6, {0.12, 0.12, 0}}, {1.2, {-0.3, 0, 0}},
    {1.2, {0.1, -0.1, 0}}, {1.0, {0, 0, 0}},    {1.4, {0, 0.2, 0}},   {1.4, {0, 0, -0.6}},    {1.2, {0.2, 0, 0}},
    {1.0, {0, 0, 0}}};

const std::vector<Command> kShort = {{1, {0, 0, 0}},    {2, {0.1, 0, 0}}, {2, {-0.2, 0, 0}}, {2, {0, 0.1, 0}},
                                     {3, {0, -0.2, 0}}, {2, {0, 0, 0.4}}, {2, {0, 0, -0.8}}, {1, {0, 0, 0}}};

DriveRecord short_drive() { return Twin{measured_base()}.drive(kShort); }

/// Without the readings from one number to before another.
DriveRecord cut_drive(int begin, int end) {
  DriveRecord record = short_drive();
  const auto cut = [&](auto& samples) { samples.erase(samples.begin() + begin, samples.begin() + end); };
  cut(record.t);
  cut(record.phi);
  cut(record.dphi);
  cut(record.torque);
  return record;
}

bool named(const std::vector<std::string>& findings, const std::string& words) {
  const auto has_words = [&](const std::string& line) { return line.find(words) != std::string::npos; };
  return std::any_of(findings.begin(), findings.end(), has_words);
}

double share_off(double found, double expected) { return std::abs(found / expected - 1); }

void expect_found(const Fit& fitted, const Scene& robot, const char* key, double tolerance) {
  EXPECT_LT(share_off(value(fitted.best.scene, key), value(robot, key)), tolerance)
      << key << ": " << value(fitted.best.scene, key) << " in place of " << value(robot, key);
}

/// Expects what the limits of identify promise of the motors, friction and the wheels' inertia.
void expect_drives_found(const Fit& fitted, const Scene& robot) {
  expect_found(fitted, robot, "velocity_proportional_gain", 0.1);
  expect_found(fitted, robot, "velocity_integral_gain", 0.1);
  expect_found(fitted, robot, "wheel_inertia", 0.25);
  // What a wheel needs at 4 rad/s, or a roller at 15 rad/s, and the share of it that does not depend on the rate.
  for (const auto& [dry, viscous, rate] :
       {std::tuple{"dry_friction", "wheel_damping", 4.0}, std::tuple{"roller_dry_friction", "roller_damping", 15.0}}) {
    const double found = value(fitted.best.scene, dry), all = found + value(fitted.best.scene, viscous) * rate;
    const double true_dry = value(robot, dry), true_all = true_dry + value(robot, viscous) * rate;
    EXPECT_LT(share_off(all, true_all), 0.1) << dry;
    EXPECT_LT(share_off(found / all, true_dry / true_all), 0.25) << dry;
  }
}

/// A robot around values other than the start's.
Twin twin_of(unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> around(0.75, 1.25);
  Twin twin{measured_base(), seed};
  RobotParameters& robot = twin.robot.robot;
  robot.dry_friction *= around(random);
  robot.mu_1 *= 3 * around(random);
  robot.roller_dry_friction *= around(random);
  robot.mu_2 *= 1.5 * around(random);
  robot.J_1 *= 1.3 * around(random);
  twin.robot.motors->gains = {0.5 * around(random), 1.2 * around(random)};
  twin.robot.motors->command_delay = 0.03 * around(random);
  return twin;
}

/// On held-out motions. Readings alone are up to 0.09 off; wheels that began 0.03 rad elsewhere add as much again.
constexpr double kMaxError = 0.12;

class TwinTest : public testing::TestWithParam<unsigned> {};

TEST_P(TwinTest, IsFoundAgain) {
  const Twin twin = twin_of(GetParam());
  std::vector<DriveRecord> records{twin.drive(kDrive)};
  std::vector<std::string> findings = inspect(records[0]);
  EXPECT_TRUE(findings.empty()) << findings[0];
  const Fit fitted = fit(measured_base(), records, findings);
  EXPECT_TRUE(findings.empty()) << findings[0];
  expect_drives_found(fitted, twin.robot);
  EXPECT_NEAR(value(fitted.best.scene, "command_delay"), value(twin.robot, "command_delay"), 5e-3);
  EXPECT_LT(fitted.error_after, kMaxError);
}

INSTANTIATE_TEST_SUITE_P(Seeds, TwinTest, testing::Values(1u, 2u, 3u));

void expect_base_found(const Fit& fitted, const Scene& robot) {
  expect_drives_found(fitted, robot);
  expect_found(fitted, robot, "wheel_radius", 0.003);
  expect_found(fitted, robot, "half_track", 0.02);
  expect_found(fitted, robot, "friction", 0.1);
  EXPECT_NEAR(value(fitted.best.scene, "com_X"), robot.robot.a_X, 0.006);
  EXPECT_NEAR(value(fitted.best.scene, "roller_angle"), robot.robot.roller_angle[0], 0.1);
  EXPECT_NEAR(value(fitted.best.scene, "command_delay"), 0, 2e-3);
}

// Its driver applies commands as the youBot's does, and ground truth is measured.
TEST(GroundTruthTwinTest, IsFoundAgain) {
  Twin twin = twin_of(4);
  twin.in_cycles = true;
  twin.ground_truth = true;
  twin.robot.motors->command_delay = 0;
  RobotParameters& robot = twin.robot.robot;
  robot.R_d *= 1.01;
  robot.R *= 1.01;
  robot.l -= 0.005;
  robot.a_X += 0.02;
  robot.roller_angle.setConstant(44.5);
  twin.robot.floor.f = 0.35;
  std::vector<DriveRecord> records{twin.drive(kDrive)};
  std::vector<std::string> findings = inspect(records[0]);
  const Fit fitted = fit(measured_base(), records, findings);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_TRUE(named(findings, "commands take effect in the cycles"));
  expect_base_found(fitted, twin.robot);
  EXPECT_LT(fitted.error_after, kMaxError);
}

// One that starts with the truth stays there, as near as the other is found. Sigmas are no bound here: twins whose
// masses differ by 1e-13 are up to 4 of them off, in one parameter or another (docs/identify.md).
TEST(EqualTwinTest, StaysAsItIs) {
  Twin twin{measured_base()};
  twin.in_cycles = true;
  twin.ground_truth = true;
  std::vector<DriveRecord> records{twin.drive(kDrive)};
  std::vector<std::string> findings = inspect(records[0]);
  const Fit fitted = fit(twin.robot, records, findings);
  expect_base_found(fitted, twin.robot);
  EXPECT_LT(fitted.error_after, kMaxError);
}

// All wheels ripple alike, so that one of them at a time finds other angles.
TEST(FindAngles, FindsThoseOfAllWheels) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const Twin twin = twin_of(seed);
    Candidate candidate{twin.robot, {Wheels::Zero()}};
    find_angles(candidate, {twin.drive(kDrive)}, {});
    const double roller = 2 * M_PI / twin.robot.robot.rollers;
    for (int i = 0; i < kWheels; ++i)
      EXPECT_NEAR(std::remainder(candidate.phi[0][i] - twin.start()[i], roller), 0, 0.03) << seed << kWheelNames[i];
  }
}

TEST(AppliedInCycles, WaitsForTheNextSampleButNotThroughAGap) {
  DriveRecord record;
  for (int k = 0; k < 100; ++k) record.t.push_back(0.02 * (k < 50 ? k : k + 40));
  const Wheels one = Wheels::Ones();
  record.commands = {{0.031, 0.035, 0.06, 1.4}, {one, 2 * one, 3 * one, 4 * one}};
  const WheelTable applied = applied_in_cycles(record).commands;
  EXPECT_EQ(applied.t, (std::vector<double>{record.t[2], record.t[3], 1.4}));
  EXPECT_EQ(applied.values[0][0], 2) << "the last one counts";
}

// Threads do not change a bit, however many there are.
TEST(Predict, DoesNotDependOnThreads) {
  const DriveRecord record = short_drive();
  const std::vector<Candidate> candidates(3, {measured_base(), {Wheels::Zero()}});
  const auto one = predict(candidates, {record}, {1}), four = predict(candidates, {record}, {4});
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    for (std::size_t j = 0; j < record.t.size(); ++j) ASSERT_TRUE((one[k][0].dphi[j] == four[k][0].dphi[j]).all());
  }
}

TEST(Inspection, FindsTheDriversSignsAndSwappedWheels) {
  const DriveRecord good = short_drive();
  DriveRecord record = good;
  for (std::size_t k = 0; k < record.t.size(); ++k) {
    for (const int left : {0, 2}) record.torque[k][left] *= -1;
    record.phi[k][3] *= -1;
    record.dphi[k][3] *= -1;
    record.torque[k][3] *= -1;
  }
  const std::vector<std::string> findings = inspect(record);
  EXPECT_TRUE(named(findings, "wheel br turns against its commands"));
  EXPECT_TRUE(named(findings, "the effort of wheel fl brakes"));
  EXPECT_FALSE(named(findings, "wheel fr"));
  for (std::size_t k = 0; k < record.t.size(); ++k) {
    ASSERT_TRUE((record.phi[k] == good.phi[k]).all());
    ASSERT_TRUE((record.dphi[k] == good.dphi[k]).all());
    ASSERT_TRUE((record.torque[k] == good.torque[k]).all());
  }
}

TEST(Inspection, FindsAmperes) {
  const DriveRecord good = short_drive();
  DriveRecord record = good;
  for (Wheels& w : record.torque) w /= Motor().torque(1);
  EXPECT_TRUE(named(inspect(record), "they are A, not N m"));
  for (std::size_t k = 0; k < record.t.size(); ++k)
    ASSERT_LT((record.torque[k] - good.torque[k]).abs().maxCoeff(), 1e-9);
}

TEST(Inspection, FindsMissingEffort) {
  DriveRecord record = short_drive();
  for (Wheels& w : record.torque) w.setZero();
  EXPECT_TRUE(named(inspect(record), "no effort"));
  EXPECT_FALSE(record.has_torque());
}

TEST(Inspection, FindsAGap) {
  DriveRecord record = cut_drive(300, 340);
  EXPECT_TRUE(named(inspect(record), "a gap in joint_states of 0.82 s at 5.98 s"));
  EXPECT_TRUE(record.is_excluded(6.3));
  EXPECT_FALSE(record.is_excluded(5.9));
}

TEST(Inspection, LeavesOutTheStartOfARecordThatBeginsInMotion) {
  DriveRecord record = cut_drive(0, 75);
  for (double& t : record.t) t -= 1.5;
  for (double& t : record.commands.t) t -= 1.5;
  EXPECT_TRUE(named(inspect(record), "begins in motion"));
  EXPECT_TRUE(record.is_excluded(0.5));
  EXPECT_FALSE(record.is_excluded(1.5));
}

TEST(Inspection, FindsAPush) {
  Twin twin{measured_base()};
  twin.push_from = 9;  // while the base goes right, 7 to 10 s
  twin.push_to = 9.5;
  twin.push = wheels_of({0, 0.5, 0});
  DriveRecord record = twin.drive(kShort), undisturbed = short_drive();
  ASSERT_TRUE(inspect(record).empty());
  EXPECT_TRUE(named(find_pushes(record, predict(twin.robot, record, Wheels::Zero())), "the base is pushed (lateral)"));
  EXPECT_TRUE(record.is_excluded(9.2));
  EXPECT_TRUE(find_pushes(undisturbed, predict(twin.robot, undisturbed, Wheels::Zero())).empty());
}

// One speed cannot tell viscous friction from dry, one direction not the rollers' from the drives'.
TEST(FirstGuess, RefusesWhatTheDriveCannotTell) {
  const Twin twin{measured_base()};
  const auto guessed = [&](const std::vector<Command>& programme) {
    std::vector<DriveRecord> records{twin.drive(programme)};
    return guess(measured_base(), records);
  };
  const FirstGuess one_speed =
      guessed({{1, {0, 0, 0}}, {2.5, {0.1, 0, 0}}, {2.5, {-0.1, 0, 0}}, {2.5, {0, 0.1, 0}}, {2.5, {0, -0.1, 0}}});
  EXPECT_TRUE(one_speed.identifiable[parameter("dry_friction")]);
  EXPECT_FALSE(one_speed.identifiable[parameter("wheel_damping")]);
  EXPECT_TRUE(named(one_speed.unidentifiable, "robot.wheel_damping: one speed"));
  const FirstGuess ahead =
      guessed({{1, {0, 0, 0}}, {2.5, {0.1, 0, 0}}, {2.5, {-0.1, 0, 0}}, {2.5, {0.2, 0, 0}}, {2.5, {-0.2, 0, 0}}});
  EXPECT_TRUE(ahead.identifiable[parameter("wheel_damping")]);
  EXPECT_FALSE(ahead.identifiable[parameter("roller_dry_friction")]);
  EXPECT_TRUE(named(ahead.unidentifiable, "robot.roller_dry_friction: nothing turned against it"));
}

TEST(Inspection, RefusesWhatCannotBeUsed) {
  DriveRecord record = short_drive();
  record.commands = {};
  EXPECT_THROW(inspect(record), UnusableRecord);
  record = short_drive();
  for (Wheels& w : record.dphi) w.setZero();
  EXPECT_THROW(inspect(record), UnusableRecord);
}

}  // namespace
}  // namespace youbot_base_sim
