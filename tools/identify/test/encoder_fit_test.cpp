// Twins: known robots are found again from encoders and poses alone; what these do not determine is named.

#include "youbot_base_sim/identify/encoder_fit.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "errors.h"
#include "temporary_folder.h"
#include "twin.h"
#include "youbot_base_sim/identify/report.h"

namespace youbot_base_sim {
namespace {

/// Three quarters of a minute in all directions.
const std::vector<Command> kDrive = {{0.5, {0, 0, 0}},       {2.6, {0.3, 0.1, 0}},     {2.2, {-0.2, 0.2, 0.5}},
                                     {2.8, {0, -0.25, 0}},   {2.4, {0.1, 0.1, -0.7}},  {2.5, {-0.3, 0, 0.3}},
                                     {2.1, {0, 0.3, 0}},     {2.9, {0.2, -0.1, 0.6}},  {2.3, {0.1, -0.3, -0.4}},
                                     {2.5, {0, 0, 0.8}},     {2.7, {-0.2, 0.3, 0}},    {2.2, {0, -0.2, -0.5}},
                                     {2.6, {0.3, 0.2, 0.2}}, {2.4, {-0.1, -0.2, 0.7}}, {2.8, {0, 0.25, -0.3}},
                                     {2.3, {-0.3, -0.1, 0}}, {2.6, {0.1, 0.2, 0.5}},   {2.5, {0, 0, 0}}};

/// The record of a twin whose ground truth has a clock of its own.
DriveRecord record_of(const Twin& twin, const std::vector<Command>& programme, const ClockMap& clock = {}) {
  DriveRecord record = twin.drive(programme);
  for (double& t : record.truth_t) t = (1 + clock.stretch) * t + clock.offset;
  record.max_truth_step = 0.1;
  return record;
}

Twin twin_of(unsigned seed) {
  Twin twin{measured_base(), seed};
  twin.ground_truth = true;
  RobotParameters& robot = twin.robot.robot;
  encoder_parameters()[0].set(twin.robot, 0.0508);
  robot.l = 0.145;
  robot.roller_angle.setConstant(44.3);
  return twin;
}

TEST(EncoderTwinTest, IsFoundAgain) {
  const Twin twin = twin_of(3);
  const ClockMap clock{0.031, 0.001};  // as the reader of bags leaves them
  const std::vector<DriveRecord> records = {record_of(twin, kDrive, clock)};
  EncoderFit fit = fit_encoders(measured_base(), records);
  EXPECT_EQ(fit.numbers.size() + fit.unidentifiable.size(), encoder_parameters().size());
  for (const Fit::Number& number : fit.numbers) {
    const Parameter& p = *number.parameter;
    EXPECT_NEAR(number.value, p.get(twin.robot), 3 * number.sigma) << p.name();
    EXPECT_GT(number.error_without, fit.error_after) << p.name();
  }
  const std::string unidentifiable = fmt::format("\n{}", fmt::join(fit.unidentifiable, "\n"));
  for (const Parameter& p : encoder_parameters()) {
    const bool named = unidentifiable.find("\n" + p.name() + ": ") != std::string::npos;
    EXPECT_TRUE(!named || p.get(fit.best.scene) == p.get(measured_base())) << p.name();
  }
  EXPECT_NEAR(fit.best.scene.robot.R, twin.robot.robot.R, 1e-4);
  EXPECT_NEAR(fit.best.scene.robot.l, twin.robot.robot.l, 5e-3);
  EXPECT_NEAR(fit.best.scene.robot.roller_angle[0], 44.3, 0.14);  // 0.005 in k_Y/k_X
  const EncoderFit::Drive& drive = fit.drives.front();
  EXPECT_NEAR(drive.clock.offset, clock.offset, 3 * drive.sigma.offset);
  EXPECT_NEAR(drive.clock.stretch, clock.stretch, 3 * drive.sigma.stretch);
  ASSERT_TRUE(drive.angles_at_zero);
  const Wheels angles = twin.start();  // where it reads zero
  for (int i = 0; i < kWheels; ++i) {
    const double off = std::remainder((*drive.angles_at_zero)[i] - angles[i], 2 * M_PI / 6);
    EXPECT_LT(std::abs(off), 3 * (*drive.angles_sigma)[i]) << i;
    EXPECT_LT((*drive.angles_sigma)[i], 0.15) << i;
  }
  EXPECT_LT(fit.error_after, 0.5 * fit.error_kinematics);
  EXPECT_LT(fit.error_after, 0.7 * fit.error_unknown);
  EXPECT_TRUE(fit.wheel_error > 2e-4 && fit.wheel_error < 1.5e-3) << fit.wheel_error;
  EXPECT_EQ(report(measured_base(), records, fit).find("--unknown-angles"), std::string::npos);
  std::swap(fit.error_after, fit.error_unknown);
  EXPECT_NE(report(measured_base(), records, fit).find("--unknown-angles"), std::string::npos);
}

TEST(EncoderTwinTest, WithoutAnglesFitsTheMean) {
  const EncoderFit fit = fit_encoders(measured_base(), {record_of(twin_of(4), kDrive)}, {{}, 0, false});
  EXPECT_FALSE(fit.drives.front().angles_at_zero);
  EXPECT_EQ(fit.error_after, fit.error_unknown);
  EXPECT_LT(fit.error_after, fit.error_kinematics);
  EXPECT_NEAR(fit.best.scene.robot.R, 0.0508, 3e-4);
  EXPECT_TRUE(fit.wheel_error > 3e-3 && fit.wheel_error < 1e-2) << fit.wheel_error;
}

// A tracker of little worth: noise of 3 mm and 10 mrad, and headings that jump by up to 0.3 rad, a tenth of the time.
TEST(EncoderTwinTest, TrackersMayBeNoisyAndJump) {
  DriveRecord record = record_of(twin_of(5), kDrive);
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (std::size_t k = 0; k < record.truth.size(); ++k) {
    const double jump = k % 100 < 10 ? 0.3 * std::cos(static_cast<double>(k / 100)) : 0;
    record.truth[k] += Eigen::Vector3d(3e-3 * normal(random), 3e-3 * normal(random), 0.01 * normal(random) + jump);
  }
  const EncoderFit fit = fit_encoders(measured_base(), {record}, {{}, 0, false});
  EXPECT_GT(fit.drives.front().jumps, 20);
  ASSERT_EQ(fit.numbers.front().parameter->name(), "robot.wheel_radius");
  EXPECT_NEAR(fit.best.scene.robot.R, 0.0508, 3 * fit.numbers.front().sigma);
  EXPECT_LT(fit.numbers.front().sigma, 1e-4);
}

// Wheels that roll forward tell their radius: neither friction of rollers, nor the track, nor where rollers stood.
TEST(EncoderTwinTest, ForwardMotionNamesWhatItDoesNotTell) {
  std::vector<Command> forward = {{0.5, {0, 0, 0}}};
  for (const double speed : {0.3, -0.2, 0.35, -0.3, 0.15, -0.35, 0.25, -0.1}) forward.push_back({2.9, {speed, 0, 0}});
  const EncoderFit fit = fit_encoders(measured_base(), {record_of(twin_of(3), forward)});
  EXPECT_NEAR(fit.best.scene.robot.R, 0.0508, 1e-4);
  EXPECT_FALSE(fit.drives.front().angles_at_zero);
  const std::string named = fmt::format("{}", fmt::join(fit.unidentifiable, "\n"));
  for (const char* name : {"robot.roller_dry_friction: ", "robot.com_X: ", "robot.com_Y: ", "floor.spin_radius: ",
                           "twin: which rollers touch the floor where the encoders read zero"}) {
    EXPECT_NE(named.find(name), std::string::npos) << name << named;
  }
  for (const Fit::Number& number : fit.numbers) {  // noise in what is held out may keep it: its sigma says so
    EXPECT_TRUE(number.parameter->name() != "robot.half_track" || number.sigma > 0.01) << number.sigma;
  }
  EXPECT_EQ(fit.best.scene.robot.roller_dry_friction[0], measured_base().robot.roller_dry_friction[0]);
}

/// The message with which a record is refused.
std::string refusal(DriveRecord record) {
  return error_of<UnusableRecord>([&] {
    inspect_encoders(record);
    fit_encoders(measured_base(), {record});
  });
}

TEST(EncoderFitTest, ItsSceneCanBeSimulated) {
  const TemporaryFolder folder;
  EncoderFit fit;
  fit.best.scene = measured_base();
  fit.resolution = 0.03;
  fit.drives.emplace_back();
  DriveRecord record;
  record.t = {0, 0.5, 1};
  record.phi.assign(3, Wheels::Zero());
  folder.write("angles.csv", angle_table(record));
  const std::string start = folder.write("start.yaml", "duration: 9\nmotors: {}\nsolver: {control_period: 1e-3}\n");
  const std::string text = fitted_scene(start, fit, record, "angles.csv");
  EXPECT_EQ(load_scene(folder.write("fitted.yaml", text)).duration, 1) << text;
  EXPECT_NE(text.find("  resolution: 0.03\n"), std::string::npos) << text;
}

TEST(EncoderFitTest, RefusesWhatItCannotFit) {
  const DriveRecord good =
      record_of(twin_of(6), {{1, {0, 0, 0}}, {3, {0.2, 0.1, 0.3}}, {3, {0, 0.2, -0.3}}, {2, {0, 0, 0}}});
  EXPECT_EQ(refusal(good), "twin: 9.0 s of readings with ground truth; must be at least 15 s");
  DriveRecord blind = good;
  blind.truth.clear();
  blind.truth_t.clear();
  EXPECT_EQ(refusal(blind),
            "twin: no ground truth; must have the pose of the base: see --topic ground_truth=TOPIC, --frames");
  DriveRecord backward = record_of(twin_of(6), kDrive);
  for (Wheels& phi : backward.phi) phi *= Wheels(1, -1, 1, -1);
  EXPECT_NE(refusal(backward).find("its ground truth does not fit the wheels' motion"), std::string::npos)
      << refusal(backward);
}

}  // namespace
}  // namespace youbot_base_sim
