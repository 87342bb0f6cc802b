#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

Wheels normal_reactions(const RobotParameters& robot, const FloorParameters& floor) {
  // a_X / h loads the front wheels, a_Y / l the left ones.
  const Wheels forward{1, 1, -1, -1};
  const Wheels left{1, -1, 1, -1};
  const double g_n = floor.g * sine_and_cosine(floor.slope).cosine;
  return robot.m_1 * g_n + robot.m * g_n / 4 * (1 + forward * (robot.a_X / robot.h) + left * (robot.a_Y / robot.l)) +
         robot.q * (forward * left);
}

Wheels RobotParameters::tan_delta() const {
  Wheels tan{-1, 1, 1, -1};
  for (int i = 0; i < kWheels; ++i) {
    // tan(45 deg + x) = (1 + tan x) / (1 - tan x)
    const auto [s, c] = sine_and_cosine((std::abs(roller_angle[i]) - 45) * (M_PI / 180));
    tan[i] *= std::copysign((c + s) / (c - s), roller_angle[i]);
  }
  return tan;
}

RobotParameters measured_robot(double scale) {
  RobotParameters robot;
  robot.dry_friction.setConstant(scale * 0.18);
  robot.mu_1.setConstant(scale * 0.01);
  robot.roller_dry_friction.setConstant(scale * 0.073);
  robot.mu_2.setConstant(scale * 0.0025);
  return robot;
}

}  // namespace youbot_base_sim
