// Steps of the wheels' rates as two real bases made them: how soon the wheels follow, by how much they overshoot, and
// how their rates ripple while rollers pass.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <string>
#include <vector>

#include "youbot_base_sim/drive/driver_kinematics.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

/// What two real bases, A and B, did when they were told a velocity at rest (docs/drop_in.md, Velocity loops). A's
/// records are of 10 Hz and tell neither at what angles the wheels started nor the load: a base that rises within a
/// factor of `factor` of it is one of its kind. A overshoots by 13 to 21 %, B by nothing that can be seen.
namespace records {

constexpr double rise_ahead = 0.26, rise_sideways = 0.52, rise_turning = 0.32;  // of A, 10 to 90 %, s
constexpr double factor = 1.7, max_overshoot = 0.21;
constexpr double speed = 0.1, turn = 0.314;  // m/s, rad/s
constexpr double settled = 1.6;              // s: B's slowest wheels were at 90 % by then

}  // namespace records

/// The answer to a step, in shares of what was told.
class RateStep {
 public:
  /// The share at time t, s; to be called with increasing times from the first after zero on.
  void add(double t, double share) {
    const auto crossing = [&](double level) { return t_ + (t - t_) * (level - share_) / (share - share_); };
    if (share_ < 0.1 && share >= 0.1 && time_to_10_ == 0) time_to_10_ = crossing(0.1);
    if (share_ < 0.9 && share >= 0.9 && time_to_90_ == 0) time_to_90_ = crossing(0.9);
    overshoot_ = std::max(overshoot_, share - 1);
    if (t >= records::settled) {
      sum_ += share;
      ++settled_;
    }
    t_ = t;
    share_ = share;
  }

  double rise() const { return time_to_90_ - time_to_10_; }  ///< s
  double time_to_90() const { return time_to_90_; }          ///< s
  double overshoot() const { return overshoot_; }
  double settled() const { return sum_ / settled_; }  ///< mean, once it has settled

 private:
  double t_ = 0, share_ = 0, time_to_10_ = 0, time_to_90_ = 0, overshoot_ = 0, sum_ = 0;
  int settled_ = 0;
};

/// Expects what base A did.
void expect_like_a_real_base(double rise, double overshoot, double settled, double rise_of_A, const std::string& what) {
  EXPECT_GT(rise, rise_of_A / records::factor) << what;
  EXPECT_LT(rise, rise_of_A * records::factor) << what;
  EXPECT_LT(overshoot, records::max_overshoot) << what;
  EXPECT_NEAR(settled, 1, 0.02) << what;
}

constexpr VelocityGains kGainsOfB{0.325, 0.5};
constexpr double kFrictionOfA = 1.3, kFrictionOfB = 0.76;  // times the measured profile's
constexpr double kDelayOfB = 0.05;                         // s

struct Base {
  RobotParameters robot;
  MotorSettings motors;
};

Base base(const RobotParameters& robot, const VelocityGains& gains = {}, double delay = 0) {
  Base base{robot, {}};
  base.motors.gains = gains;
  base.motors.command_delay = delay;
  return base;
}

struct Response {
  double rise = 0, time_to_90 = 0;    // s
  double overshoot = 0, settled = 0;  // of the mean over the wheels
  double ripple = 0;                  // amplitude of a wheel's rate at as many times a turn as it has rollers, rad/s
};

/// Commands a velocity (m/s, m/s, rad/s) at t = 0 to a base at rest whose wheels stand at angles phi, rad.
Response respond_from(const Wheels& phi, const Base& base, const Eigen::Vector3d& velocity) {
  constexpr double kDuration = 4, kInterval = 5e-3;  // s
  const Wheels rates = DriverKinematics().wheel_rates(velocity);
  Scene scene;
  scene.robot = base.robot;
  scene.motors = base.motors;
  scene.initial.phi() = phi;
  scene.solver.relative_tolerance = 1e-5;
  scene.solver.absolute_tolerance = 1e-8;
  scene.solver.control_period = 1e-3;
  scene.drive = VelocityTable{{{0.0}, {rates}}};
  Simulation simulation(scene);

  RateStep step;
  std::array<std::complex<double>, kWheels> harmonic{};
  int settled = 0;
  for (int k = 1; k * kInterval <= kDuration; ++k) {
    simulation.advance_to(k * kInterval);
    const State& x = simulation.state();
    step.add(k * kInterval, (x.dphi() / rates).mean());
    if (k * kInterval < records::settled) continue;
    ++settled;
    for (int i = 0; i < kWheels; ++i) {
      harmonic[i] += (x.dphi()[i] - rates[i]) * std::polar(1.0, scene.robot.rollers * x.phi()[i]);
    }
  }
  Response response{step.rise(), step.time_to_90(), step.overshoot(), step.settled(), 0};
  for (const auto& sum : harmonic) response.ripple += 2 * std::abs(sum) / settled / kWheels;
  return response;
}

/// The mean over some angles at which the wheels may start: sideways and turning it matters which rollers pass when.
Response respond(const Base& base, const Eigen::Vector3d& velocity) {
  const std::vector<Wheels> starts = {Wheels(0, 0, 0, 0), Wheels(0.3, 0.9, 0.6, 0.1), Wheels(0.5, 0.2, 0.8, 0.4),
                                      Wheels(0.9, 0.7, 0.1, 0.5)};
  const double share = 1.0 / static_cast<double>(starts.size());
  Response mean;
  for (const Wheels& phi : starts) {
    const Response one = respond_from(phi, base, velocity);
    mean.rise += share * one.rise;
    mean.time_to_90 += share * one.time_to_90;
    mean.overshoot += share * one.overshoot;
    mean.settled += share * one.settled;
    mean.ripple += share * one.ripple;
  }
  return mean;
}

const Eigen::Vector3d kAhead(records::speed, 0, 0), kSideways(0, records::speed, 0), kTurning(0, 0, records::turn);

// What base A did.
struct Motion {
  const char* name;
  Eigen::Vector3d velocity;
  double rise, overshoot;
} const kMotions[] = {{"ahead", kAhead, records::rise_ahead, 0.21},
                      {"sideways", kSideways, records::rise_sideways, 0.15},
                      {"turning", kTurning, records::rise_turning, 0.13}};

TEST(StepResponseTest, OfDefaultMotorsIsThatOfARealBase) {
  for (const RobotParameters& robot : {RobotParameters(), measured_robot()}) {
    for (const Motion& motion : kMotions) {
      const Response response = respond(base(robot), motion.velocity);
      expect_like_a_real_base(response.rise, response.overshoot, response.settled, motion.rise, motion.name);
    }
  }
}

// The default gains are a compromise between the two bases: under A's friction turning takes longer than this from
// rather more than half of all angles at which the wheels may start (docs/validation.md).
TEST(StepResponseTest, OfDefaultMotorsUnderTheFrictionOfA) {
  const Base slow = base(measured_robot(kFrictionOfA));
  for (const Motion& motion : kMotions) {
    const Response response = respond_from(Wheels::Zero(), slow, motion.velocity);
    expect_like_a_real_base(response.rise, response.overshoot, response.settled, motion.rise, motion.name);
  }
}

TEST(StepResponseTest, OfBaseAWithItsProfile) {
  const Scene scene = default_scene({{"robot.profile", "measured_a", true}}, SceneUse::kCommands);
  for (const Motion& motion : kMotions) {
    const Response response = respond({scene.robot, *scene.motors}, motion.velocity);
    EXPECT_NEAR(response.rise / motion.rise, 1, 0.2) << motion.name;
    EXPECT_NEAR(response.overshoot / motion.overshoot, 1, 0.2) << motion.name;
  }
}

TEST(StepResponseTest, OfBaseBWithItsFrictionGainsAndDelay) {
  const Base B = base(measured_robot(kFrictionOfB), kGainsOfB, kDelayOfB);
  const Response ahead = respond(B, 2 * kAhead), sideways = respond(B, 2 * kSideways);
  EXPECT_LT(ahead.time_to_90, 0.3);
  EXPECT_LT(ahead.overshoot, 0.05) << "no clear overshoot";
  EXPECT_GT(sideways.time_to_90, 0.7);
  EXPECT_LT(sideways.time_to_90, 1.6);
}

TEST(StepResponseTest, RipplesAsRollersPassSideways) {
  const Response response = respond(base(measured_robot(kFrictionOfA), {0.4, 1.6}), kSideways);
  EXPECT_GT(response.ripple, 0.09);
  EXPECT_LT(response.ripple, 0.27);
}

}  // namespace
}  // namespace youbot_base_sim
