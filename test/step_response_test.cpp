// Steps of the wheels' rates as two real bases made them: how soon the wheels follow, by how much they overshoot, and
// how their rates ripple while rollers pass.

#include "step_response.h"

#include <array>
#include <cmath>
#include <complex>
#include <vector>

#include "youbot_base_sim/drive/driver_kinematics.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

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
