#include "youbot_base_sim/identify/fitted_parameters.h"

#include <cmath>
#include <stdexcept>

namespace youbot_base_sim {

namespace {

void set_radius(Scene& c, double radius) {
  RobotParameters& robot = c.robot;
  robot.R_d *= radius / robot.R;  // a larger wheel of the same shape
  robot.R = radius;
}

/// Its size; each wheel's sign stays as it is.
double roller_angle(const Scene& c) { return c.robot.roller_angle.abs().mean(); }

void set_roller_angle(Scene& c, double angle) {
  for (double& of_wheel : c.robot.roller_angle) of_wheel = std::copysign(angle, of_wheel);
}

constexpr char kTwoSpeeds[] = "forward, lateral and in yaw at two speeds each that differ by a factor of 2 or more";
constexpr char kSteps[] = "steps from rest to 0.2 m/s and back, forward, lateral and in yaw";
constexpr char kTruth[] = "longer forward, lateral and in yaw, with ground truth at least as exact";
constexpr char kLateral[] = "further in all directions, laterally above all";
constexpr char kSlip[] = "starts and stops so hard that wheels slide, with ground truth";

}  // namespace

const std::vector<Parameter>& parameters() {
  using C = Scene;
  static const std::vector<Parameter> table = {
      {"motors", "velocity_proportional_gain", "N m s/rad", 0.02, 20, 0.01, Needs::kRates, true, kSteps,
       [](const C& c) { return c.motors->gains.proportional; },
       [](C& c, double p) { c.motors->gains.proportional = p; }},
      {"motors", "velocity_integral_gain", "N m/rad", 0, 200, 0.03, Needs::kRates, true, kSteps,
       [](const C& c) { return c.motors->gains.integral; }, [](C& c, double p) { c.motors->gains.integral = p; }},
      {"motors", "command_delay", "s", 0, 0.5, 0.002, Needs::kRates, false, kSteps,
       [](const C& c) { return c.motors->command_delay; }, [](C& c, double p) { c.motors->command_delay = p; }},
      {"robot", "dry_friction", "N m", 0, 2, 0.005, Needs::kTorques, false, kTwoSpeeds,
       [](const C& c) { return c.robot.dry_friction.mean(); },
       [](C& c, double p) { c.robot.dry_friction.setConstant(p); }},
      {"robot", "wheel_damping", "N m s", 0, 0.5, 0.001, Needs::kTorques, false, kTwoSpeeds,
       [](const C& c) { return c.robot.mu_1.mean(); }, [](C& c, double p) { c.robot.mu_1.setConstant(p); }},
      {"robot", "roller_dry_friction", "N m", 0, 0.5, 0.002, Needs::kTorques, false, kTwoSpeeds,
       [](const C& c) { return c.robot.roller_dry_friction.mean(); },
       [](C& c, double p) { c.robot.roller_dry_friction.setConstant(p); }},
      {"robot", "roller_damping", "N m s", 0, 0.05, 1e-4, Needs::kTorques, false, kTwoSpeeds,
       [](const C& c) { return c.robot.mu_2.mean(); }, [](C& c, double p) { c.robot.mu_2.setConstant(p); }},
      {"robot", "wheel_inertia", "kg m^2", 1e-4, 0.1, 2e-4, Needs::kTorques, false, kSteps,
       [](const C& c) { return c.robot.J_1; }, [](C& c, double p) { c.robot.J_1 = p; }},
      {"robot", "total_inertia", "kg m^2", 0.5, 50, 0.1, Needs::kTorques, false, kSteps,
       [](const C& c) { return c.robot.I_s; }, [](C& c, double p) { c.robot.I_s = p; }},
      {"floor", "friction", "", 0.05, 2, 0.02, Needs::kTruth, false, kSlip, [](const C& c) { return c.floor.f.mean(); },
       [](C& c, double p) { c.floor.f.setConstant(p); }},
      {"robot", "wheel_radius", "m", 0.02, 0.1, 1e-4, Needs::kTruth, false, kTruth,
       [](const C& c) { return c.robot.R; }, set_radius},
      {"robot", "half_track", "m", 0.05, 0.5, 1e-3, Needs::kTruth, false, kTruth, [](const C& c) { return c.robot.l; },
       [](C& c, double p) { c.robot.l = p; }},
      {"robot", "roller_angle", "deg", 5, 85, 0.1, Needs::kTruth, false, kTruth, roller_angle, set_roller_angle},
      {"robot", "com_X", "m", -0.1, 0.1, 2e-3, Needs::kTruth, false, kTruth, [](const C& c) { return c.robot.a_X; },
       [](C& c, double p) { c.robot.a_X = p; }},
      {"robot", "com_Y", "m", -0.1, 0.1, 2e-3, Needs::kTruth, false, kTruth, [](const C& c) { return c.robot.a_Y; },
       [](C& c, double p) { c.robot.a_Y = p; }},
  };
  return table;
}

const std::vector<Parameter>& encoder_parameters() {
  using C = Scene;
  static const std::vector<Parameter> table = {
      {"robot", "wheel_radius", "m", 5e-3, 0.5, 1e-4, Needs::kTruth, false, "further forward",
       [](const C& c) { return c.robot.R; }, set_radius},
      {"robot", "half_track", "m", 0.02, 2, 1e-3, Needs::kTruth, false, "further in yaw",
       [](const C& c) { return c.robot.l; }, [](C& c, double p) { c.robot.l = p; }},
      {"robot", "roller_dry_friction", "N m", 0, 0.5, 0.002, Needs::kTruth, false, kLateral,
       [](const C& c) { return c.robot.roller_dry_friction.mean(); },
       [](C& c, double p) { c.robot.roller_dry_friction.setConstant(p); }},
      {"robot", "roller_angle", "deg", 5, 85, 0.1, Needs::kTruth, false, kLateral, roller_angle, set_roller_angle},
      {"robot", "com_X", "m", -0.3, 0.3, 2e-3, Needs::kTruth, false, kLateral, [](const C& c) { return c.robot.a_X; },
       [](C& c, double p) { c.robot.a_X = p; }},
      {"robot", "com_Y", "m", -0.3, 0.3, 2e-3, Needs::kTruth, false, kLateral, [](const C& c) { return c.robot.a_Y; },
       [](C& c, double p) { c.robot.a_Y = p; }},
      {"floor", "spin_radius", "m", 0, 0.01, 2e-4, Needs::kTruth, false, kLateral,
       [](const C& c) { return c.floor.spin_radius; }, [](C& c, double p) { c.floor.spin_radius = p; }},
      {"floor", "slip_regularization", "m/s", 1e-4, 0.05, 1e-4, Needs::kTruth, false, kLateral,
       [](const C& c) { return c.floor.nu; }, [](C& c, double p) { c.floor.nu = p; }},
  };
  return table;
}

std::size_t parameter(const std::string& key) {
  for (std::size_t k = 0; k < parameters().size(); ++k) {
    if (key == parameters()[k].key) return k;
  }
  throw std::logic_error(key + ": no parameter");
}

}  // namespace youbot_base_sim
