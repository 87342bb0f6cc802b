// Odometry by replay: what encoders of a simulated base read must lead back to where it went.

#include "youbot_base_sim/slip_odometry/slip_odometry.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "temporary_folder.h"
#include "youbot_base_sim/slip_odometry/wheel_stream.h"

namespace youbot_base_sim {
namespace {

constexpr double kInterval = 0.02;  // s, of readings

/// Wheel rates of a minute and a half in random directions.
std::string all_directions() {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> share(-1, 1), length(2, 4);
  std::string table = "t,fl,fr,bl,br\n";
  for (double t = 0; t < 90; t += length(random)) {
    const Wheels w = DriverKinematics().wheel_rates({0.4 * share(random), 0.3 * share(random), 0.8 * share(random)});
    table += fmt::format("{},{},{},{},{}\n", t, w[0], w[1], w[2], w[3]);
  }
  return table;
}

Scene scene_of(const std::string& text) {
  static const TemporaryFolder folder;
  folder.write("rates.csv",
               "t,fl,fr,bl,br\n0,4,4,4,4\n2,-4,4,4,-4\n4,4,-4,4,-4\n6,2,6,4,0\n8,0,0,0,0\n9,-4,-2,-2,-4\n11,0,0,0,0\n");
  folder.write("between.csv",
               "t,fl,fr,bl,br\n0,4,4,4,4\n1.008,-4,4,4,-4\n2.013,4,-4,4,-4\n3.507,2,6,4,0\n5.006,-4,4,4,-4\n6.511,"
               "4,4,-4,-4\n8.009,-6,-2,0,-4\n9.512,4,-4,-4,4\n11.006,0,0,0,0\n");
  folder.write("all.csv", all_directions());
  folder.write("ahead.csv", "t,fl,fr,bl,br\n0,4,4,4,4\n4,-6,-6,-6,-6\n8,2,2,2,2\n12,6,6,6,6\n16,-3,-3,-3,-3\n");
  return load_scene(folder.write("scene.yaml", text));
}

const std::string kRobot = "robot: {profile: measured}\n";
const std::string kDrive = "duration: 12\ndrive: {velocity_table: rates.csv}\nmotors: {quantized: true}\n" + kRobot;

/// Drives the base and calls `read` with each reading of its encoders, which round to ticks.
void drive(const std::function<void(double t, const Wheels& phi, const Simulation& truth)>& read,
           const std::string& scene = kDrive) {
  Simulation truth(scene_of(scene));
  const double tick = Motor().tick();
  for (int k = 0; k * kInterval <= truth.scene().duration; ++k) {
    truth.advance_to(k * kInterval);
    read(k * kInterval, tick * (truth.state().phi() / tick).floor(), truth);
  }
}

double distance(const Eigen::Vector3d& pose, const State& x) {
  return std::hypot(pose[0] - x.x(), pose[1] - x.y(), 0.3 * (pose[2] - x.psi()));
}

const std::string kKnown = "duration: 1\n" + kRobot;
const SlipOdometry::Settings kAngles{{}, 0.5, 30, 1, Wheels(Wheels::Zero()), 4};

TEST(SlipOdometryTest, FindsWhereTheBaseWent) {
  SlipOdometry in_phase(scene_of(kKnown), kAngles), unknown(scene_of(kKnown), {});
  WheelOdometry plain({0.05, 0.385}, Wheels::Zero());
  Eigen::Array3d largest = Eigen::Array3d::Zero();
  drive([&](double t, const Wheels& phi, const Simulation& truth) {
    in_phase.update(t, phi, truth.torque());
    unknown.update(t, phi, truth.torque());
    plain.update(phi);
    EXPECT_EQ(in_phase.doubt() + unknown.doubt(), "") << t;
    const State& x = truth.state();
    largest = largest.max(
        Eigen::Array3d(distance(in_phase.pose(), x), distance(unknown.pose(), x), distance(plain.pose(), x)));
  });
  EXPECT_LT(largest[0], 0.001);
  EXPECT_LT(largest[1], 0.2 * largest[2]);
  EXPECT_GT(largest[2], 0.05);
}

TEST(SlipOdometryTest, EndsWhereTheBaseStandsWherePhasesAreKnown) {
  const std::string start = "initial: {wheel_angles: [0.1, 0.4, 0.7, 0.9]}\n";
  const Wheels at_zero(3, -1, 0.2, 7);
  SlipOdometry::Settings known;
  known.angles_at_zero = at_zero;
  SlipOdometry odometry(scene_of(kKnown), known);
  State end;
  drive(
      [&](double t, const Wheels& phi, const Simulation& truth) {
        odometry.update(t, phi - at_zero);
        end = truth.state();
      },
      kDrive + start);
  EXPECT_LT(distance(odometry.pose(), end), 0.0005);
}

// Commands that come between readings: only the wheels' rates show when.
TEST(SlipOdometryTest, RatesThatFitTheAnglesHelp) {
  const std::string drive_between =
      "duration: 12\ndrive: {velocity_table: between.csv}\nmotors: {quantized: true}\n" + kRobot;
  SlipOdometry angles(scene_of(kKnown), kAngles), rates(scene_of(kKnown), kAngles), reversed(scene_of(kKnown), kAngles),
      rpm(scene_of(kKnown), kAngles), wrong(scene_of(kKnown), kAngles);
  Eigen::Array4d off = Eigen::Array4d::Zero();  // the sum over readings, m
  drive(
      [&](double t, const Wheels& phi, const Simulation& truth) {
        const State& x = truth.state();
        angles.update(t, phi);
        rates.update(t, phi, {}, x.dphi());
        reversed.update(t, phi, {}, Wheels(x.dphi() * Wheels(-1, 1, -1, 1)));
        rpm.update(t, phi, {}, Wheels(30 / M_PI * x.dphi()));
        wrong.update(t, phi, {}, Wheels(x.dphi() * Wheels(1, 1, 2, 0)));
        off += Eigen::Array4d(distance(angles.pose(), x), distance(rates.pose(), x), distance(reversed.pose(), x),
                              distance(rpm.pose(), x));
      },
      drive_between);
  EXPECT_LT(off[1], 0.8 * off[0]);
  EXPECT_LT(off[2], 0.8 * off[0]);
  EXPECT_LT(off[3], 0.8 * off[0]);
  EXPECT_TRUE((rates.rate_factors() == 1).all());
  EXPECT_TRUE((reversed.rate_factors() == Wheels(-1, 1, -1, 1)).all());
  EXPECT_LT((rpm.rate_factors() / (30 / M_PI) - 1).abs().maxCoeff(), 0.02);
  EXPECT_EQ(wrong.rate_factors()[3], 0);
}

WheelStream stream_of(double unit) {
  WheelStream stream;
  stream.joints = {"a", "b", "c", "d"};
  stream.rad_per_unit = unit * Wheels(1, 1, 1, -1);
  return stream;
}

// In rad or ticks of 1 mrad, of a counter whose numbers begin anew after `period`, 300 ticks after the start.
TEST(WheelStreamTest, PositionsThatBeginAnewAreCountedOn) {
  for (const double period : {HUGE_VAL, 2 * M_PI, 65536.0, 1e5, 4294967296.0}) {
    const bool ticks = period > 10 && std::isfinite(period);
    WheelStream stream = stream_of(ticks ? 1e-3 : 1);
    std::string found;
    for (int k = 0; k < 3000; ++k) {
      const double t = 0.02 * k, angle = 40 * std::sin(0.1 * t);
      double count = ticks ? period - 300 + std::round(1e3 * angle) : angle;
      if (std::isfinite(period)) count -= period * std::floor(count / period);
      const auto reading =
          stream.read("/driver", t, {"arm", "d", "b", "a", "c"}, {9, -count, count, count, count}, {}, {});
      ASSERT_TRUE(reading);
      EXPECT_NEAR(reading->phi[0] - (ticks ? 1e-3 * (period - 300) : 0), angle, period == 1e5 ? 3e-3 : 1e-3)
          << period << " " << t;
      EXPECT_EQ(reading->phi[3], reading->phi[0]);
      found += stream.finding();
    }
    EXPECT_EQ(found.find("positions begin anew after ") == 0, std::isfinite(period)) << found;
  }
}

TEST(WheelStreamTest, OnePublisherCounts) {
  for (const char* chosen : {"", "/driver"}) {
    WheelStream stream = stream_of(1);
    stream.publisher = chosen;
    const auto counts = [&](const char* from, double t) {
      return stream.read(from, t, {"a", "b", "c", "d"}, {0, 0, 0, 0}, {}, {}).has_value();
    };
    EXPECT_TRUE(counts("/driver", 0));
    EXPECT_FALSE(counts("/gui", 0.01));
    EXPECT_EQ(stream.finding(), "/gui publishes joint_states too: follows /driver (to choose: ~publisher)");
    EXPECT_EQ(counts("/gui", 9), !*chosen);
  }
}

// Readings of the same instant, or nearly: none of what they say is lost.
TEST(SlipOdometryTest, ReadingsThatComeTwiceAreReadOnce) {
  SlipOdometry odometry(scene_of(kKnown), {}), twice(scene_of(kKnown), {});
  drive([&](double t, const Wheels& phi, const Simulation&) {
    odometry.update(t, phi);
    twice.update(t, phi);
    twice.update(t, phi + 0.01);
    twice.update(t + 1e-4, phi + 0.02);
    EXPECT_EQ(twice.doubt(), "");
    EXPECT_EQ(twice.pose(), odometry.pose()) << t;
  });
}

const std::string kGuessed =
    "duration: 1\nrobot: {profile: measured, roller_dry_friction: 0.08, dry_friction: 0.2, com: [0.018, -0.023], "
    "body_mass: 33}\n";
const std::string kFit =
    "duration: 1\nrobot: {profile: measured, roller_dry_friction: 0.0745, com: [0.0166, -0.0254], half_track: 0.1503, "
    "wheel_radius: 0.05003}\n";

Eigen::Vector3d displacement(const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return turned(b - a, -a[2]); }

/// The error of the angles that efforts tell against those where the encoders read zero, over sigma.
Wheels found_off(const PhaseSearch& search, const Wheels& at_zero) {
  const Wheels off = search.phases(0) - at_zero;
  const double pitch = 2 * M_PI / 6;
  return (off - pitch * (off / pitch).round()) / search.sigma();
}

// In mA, of motors that count backward on the left, with friction that is 10 % off; and again after a jump.
TEST(SlipOdometryTest, EffortsTellWhichRollersTouchTheFloor) {
  const Wheels at_zero(3, -1, 0.2, 7), jump(0, 0, 40, 0);
  SlipOdometry odometry(scene_of(kGuessed), {}), jumps(scene_of(kGuessed), {}), without(scene_of(kGuessed), {});
  const double quantum = Motor().milliampere();
  Eigen::Array2d off = Eigen::Array2d::Zero();  // over a second, m
  Eigen::Vector3d found = Eigen::Vector3d::Zero(), unknown = found, truly = found;
  int k = 0;
  drive(
      [&](double t, const Wheels& phi, const Simulation& truth) {
        const Wheels torque = Wheels(-1, 1, -1, 1) * quantum * (truth.torque() / quantum).round();
        odometry.update(t, phi - at_zero, torque, truth.state().dphi());
        jumps.update(t, phi - at_zero + (t < 5 ? Wheels(Wheels::Zero()) : jump), torque, truth.state().dphi());
        without.update(t, phi - at_zero, {}, truth.state().dphi());
        if (++k % 50 != 0) return;
        const State& x = truth.state();
        const Eigen::Vector3d now(x.x(), x.y(), x.psi());
        const Eigen::Vector3d moved = displacement(truly, now);
        if (odometry.search()->found()) {
          off += Eigen::Array2d((displacement(found, odometry.pose()) - moved).norm(),
                                (displacement(unknown, without.pose()) - moved).norm());
        }
        found = odometry.pose();
        unknown = without.pose();
        truly = now;
      },
      "duration: 90\ndrive: {velocity_table: all.csv}\nmotors: {quantized: true}\n" + kRobot);
  ASSERT_TRUE(odometry.search()->found() && jumps.search()->found());
  EXPECT_FALSE(without.search());
  EXPECT_LT(odometry.search()->sigma().maxCoeff(), 0.03);
  EXPECT_LT(found_off(*odometry.search(), at_zero).abs().maxCoeff(), 3);
  EXPECT_LT(found_off(*jumps.search(), at_zero - jump).abs().maxCoeff(), 3);
  EXPECT_GT(off[1], 0);
  EXPECT_LT(off[0], 0.5 * off[1]);
}

// Rollers do not turn there: no ripple.
TEST(SlipOdometryTest, ForwardMotionDoesNotTellThem) {
  SlipOdometry odometry(scene_of(kKnown), {});
  drive([&](double t, const Wheels& phi, const Simulation& truth) { odometry.update(t, phi, truth.torque()); },
        "duration: 20\ndrive: {velocity_table: ahead.csv}\nmotors: {quantized: true}\n" + kRobot);
  ASSERT_TRUE(odometry.search());
  EXPECT_FALSE(odometry.search()->found());
  EXPECT_GT(odometry.search()->sigma().maxCoeff(), 0.1);
}

// Of parameters known within 10 %, without and with efforts; and of fitted ones with angles.
TEST(SlipOdometryTest, ItsCovarianceIsThatOfItsErrors) {
  Eigen::Array3d nees = Eigen::Array3d::Zero();
  for (int k = 0; k < 12; ++k) {
    SlipOdometry unknown(scene_of(kGuessed), {}), known(scene_of(kGuessed), {}), fitted(scene_of(kFit), kAngles);
    State end;
    drive(
        [&](double t, const Wheels& phi, const Simulation& truth) {
          unknown.update(t, phi);
          known.update(t, phi, truth.torque());
          fitted.update(t, phi);
          end = truth.state();
        },
        kDrive + fmt::format("initial: {{wheel_angles: [{}, {}, {}, {}]}}\n", 0.1 * k, 0.23 * k, 0.57 * k, 0.91 * k));
    int c = 0;
    for (const SlipOdometry* odometry : {&unknown, &known, &fitted}) {
      const Eigen::Vector3d error = odometry->pose() - Eigen::Vector3d(end.x(), end.y(), end.psi());
      nees[c++] += error.dot(odometry->pose_covariance().inverse() * error) / 12;
    }
  }
  EXPECT_TRUE((nees > 1 && nees < 4).all()) << nees.transpose();  // 3 is exact, less is careful
}

TEST(SlipOdometryTest, ReadingsThatAreNotFiniteAreLeftOut) {
  SlipOdometry odometry(scene_of(kKnown), {});
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  int k = 0;
  Eigen::Vector3d before;
  drive([&](double t, const Wheels& phi, const Simulation& truth) {
    before = odometry.pose();
    if (++k % 5 == 0) {
      odometry.update(t, phi * Wheels(1, k % 2 == 0 ? kNan : kInfinity, 1, 1));
      EXPECT_EQ(odometry.doubt(), "a reading is not finite");
      EXPECT_EQ(odometry.pose(), before);
    } else {
      odometry.update(t, phi, Wheels(truth.torque() * kNan));
      EXPECT_EQ(odometry.doubt(), "");
    }
    EXPECT_LT(distance(odometry.pose(), truth.state()), 0.03);
  });
}

// An encoder is switched on again: it is left out once, and named.
TEST(SlipOdometryTest, AnEncoderThatJumpsIsNamed) {
  SlipOdometry odometry(scene_of(kKnown), {});
  int doubts = 0;
  drive([&](double t, const Wheels& phi, const Simulation& truth) {
    const double variance = odometry.pose_covariance()(0, 0);
    odometry.update(t, t < 5 ? phi : phi + Wheels(0, 0, 40, 0));
    EXPECT_LT(distance(odometry.pose(), truth.state()), 0.03);
    if (odometry.doubt().empty()) return;
    ++doubts;
    EXPECT_EQ(odometry.doubt().find("an encoder has jumped: bl by 4"), 0u) << odometry.doubt();
    EXPECT_GT(odometry.pose_covariance()(0, 0), variance);
    EXPECT_LT(odometry.pose_covariance()(0, 0), variance + 2.5e-5) << "0.2 m/s for 0.02 s";
  });
  EXPECT_EQ(doubts, 1);
}

TEST(SlipOdometryTest, CatchesUpAfterAGap) {
  SlipOdometry odometry(scene_of(kKnown), {});
  drive([&](double t, const Wheels& phi, const Simulation& truth) {
    if (t > 2.5 && t < 3.5) return;
    odometry.update(t, phi);
    if (t >= 3.5 && t < 3.51) {
      EXPECT_EQ(odometry.doubt().find("no reading for 1"), 0u) << odometry.doubt();
    } else {
      EXPECT_EQ(odometry.doubt(), "");
    }
    EXPECT_LT(distance(odometry.pose(), truth.state()), 0.03 + 2 * std::sqrt(odometry.pose_covariance().trace()));
  });
}

TEST(SlipOdometryTest, ATimeThatGoesBackBeginsAnew) {
  SlipOdometry odometry(scene_of(kKnown), {});
  drive([&](double t, const Wheels& phi, const Simulation& truth) {
    odometry.update(t < 6 ? t : t - 6, phi);
    EXPECT_EQ(odometry.doubt().empty(), std::abs(t - 6) > 0.01) << t;
    EXPECT_LT(distance(odometry.pose(), truth.state()), 0.03);
  });
}

// Nothing fills in the stamps: the pose stays, and is known worse with each reading.
TEST(SlipOdometryTest, ATimeThatStandsStillIsNamed) {
  SlipOdometry odometry(scene_of(kKnown), {});
  for (int k = 0; k < 400; ++k) {
    const double variance = odometry.pose_covariance()(0, 0);
    odometry.update(0, Wheels::Constant(0.12 * k));
    const std::string doubt = k == 0 ? "" : "the time of readings stands still while wheels turn by ";
    EXPECT_EQ(odometry.doubt().substr(0, doubt.size()), doubt) << k;
    EXPECT_EQ(odometry.doubt().empty(), doubt.empty()) << k;
    if (k > 0) {
      EXPECT_GT(odometry.pose_covariance()(0, 0), variance);
    }
  }
  EXPECT_GT(std::sqrt(odometry.pose_covariance()(0, 0)), 0.1) << "wheels of 0.05 m turned by 48 rad";
}

TEST(SlipOdometryTest, ResetsInMotion) {
  SlipOdometry odometry(scene_of(kKnown), kAngles);
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  drive([&](double t, const Wheels& phi, const Simulation& truth) {
    odometry.update(t, phi);
    const State& x = truth.state();
    if (std::abs(t - 3) < 0.01) {
      odometry.reset();
      EXPECT_EQ(odometry.pose(), Eigen::Vector3d::Zero());
      start = {x.x(), x.y(), x.psi()};
    }
    if (t < 3.01) return;
    const Eigen::Vector3d moved = turned({x.x() - start[0], x.y() - start[1], 0}, -start[2]);
    EXPECT_LT((odometry.pose() - Eigen::Vector3d(moved[0], moved[1], x.psi() - start[2])).norm(), 0.002);
  });
}

// The efforts tell of a push that the wheels hold.
TEST(SlipOdometryTest, NoticesAPushByTheEfforts) {
  const std::string pushed = "duration: 6\ndrive: {velocity_table: rates.csv}\nmotors: {}\n" + kRobot +
                             "wrenches: [{force: [0, 150, 0], start: 3}]\n";
  SlipOdometry odometry(scene_of(kKnown), {});
  drive(
      [&](double t, const Wheels& phi, const Simulation& truth) {
        odometry.update(t, phi, truth.torque());
        EXPECT_TRUE(t > 3 || odometry.doubt().empty()) << t << odometry.doubt();
        EXPECT_TRUE(t < 5.5 || odometry.doubt().find("efforts are ") == 0) << t << odometry.doubt();
      },
      pushed);
}

// The driver's motors count efforts backward on the left.
TEST(SlipOdometryTest, FindsTheSignsOfEfforts) {
  SlipOdometry odometry(scene_of(kKnown), {});
  EXPECT_TRUE((odometry.effort_signs() == 0).all());
  drive([&](double t, const Wheels& phi, const Simulation& truth) {
    odometry.update(t, phi, Wheels(truth.torque() * Wheels(-1, 1, -1, 1)));
    EXPECT_EQ(odometry.doubt(), "") << t;
  });
  EXPECT_TRUE((odometry.effort_signs() == Wheels(-1, 1, -1, 1)).all()) << odometry.effort_signs().transpose();
}

TEST(SlipOdometryTest, EffortsThatTellNothingDoNotCount) {
  SlipOdometry odometry(scene_of(kKnown), {});
  std::mt19937_64 random;
  std::normal_distribution<double> any(0, 3);
  drive([&](double t, const Wheels& phi, const Simulation&) {
    odometry.update(t, phi, Wheels(any(random), any(random), 0, 0));
    EXPECT_EQ(odometry.doubt(), "") << t;
  });
  EXPECT_TRUE((odometry.effort_signs() == 0).all()) << odometry.effort_signs().transpose();
}

// Over a night, as far as encoders may count: work stays bounded, and the next readings are followed.
TEST(SlipOdometryTest, ALongWayBetweenReadingsIsRolled) {
  SlipOdometry odometry(scene_of(kKnown), {});
  for (int k = 0; k < 50; ++k) odometry.update(0.02 * k, Wheels::Constant(0.1 * k));
  odometry.update(1e5, Wheels::Constant(1e6));
  odometry.update(1e5 + 0.02, Wheels::Constant(1e6 + 0.1));
  EXPECT_EQ(odometry.doubt(), "the simulation begins anew: the wheels have turned too far since the last reading");
  EXPECT_NEAR(odometry.pose()[0], 5e4, 5);
  odometry.update(1e5 + 0.04, Wheels::Constant(1e6 + 0.2));
  EXPECT_EQ(odometry.doubt(), "");
  EXPECT_GT(odometry.pose_covariance()(0, 0), 1);
}

// A base on blocks: wheels that turn as no base could roll.
TEST(SlipOdometryTest, NoticesWheelsThatTurnAgainstEachOther) {
  SlipOdometry odometry(scene_of(kKnown), {});
  for (int k = 0; k < 100; ++k) odometry.update(0.02 * k, 0.1 * k * Wheels(1, 1, -1, -1));
  EXPECT_EQ(odometry.doubt().find("front and rear wheels turn against each other by 0.25 m/s"), 0u);
  EXPECT_GT(odometry.pose_covariance()(0, 0), 0.1);
}

// Anything at all: it stays finite, and its work bounded.
TEST(SlipOdometryTest, StaysFiniteWhateverItReads) {
  std::mt19937_64 random;
  std::uniform_real_distribution<double> exponent(-12, 12), sign(-1, 1);
  SlipOdometry odometry(scene_of(kKnown), {});
  double t = 0;
  for (int k = 0; k < 300; ++k) {
    t += sign(random) > -0.9 ? std::pow(10, exponent(random) / 3) : -1;
    const auto number = [&] { return sign(random) * std::pow(10, exponent(random)); };
    odometry.update(t, Wheels(number(), number(), number(), number()), Wheels(number(), number(), number(), number()));
    ASSERT_TRUE(odometry.pose().allFinite() && odometry.velocity().allFinite()) << k;
    ASSERT_TRUE(odometry.pose_covariance().allFinite() && odometry.velocity_covariance().allFinite()) << k;
  }
}

}  // namespace
}  // namespace youbot_base_sim
