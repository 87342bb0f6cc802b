#include "youbot_base_sim/physics/inertia.h"

namespace youbot_base_sim {

Inertia::Inertia(const RobotParameters& robot) : J_1(robot.J_1), J_2(robot.J_2) {
  const double m_s = robot.m_s(), m_a_X = robot.m * robot.a_X, m_a_Y = robot.m * robot.a_Y;
  M_v << m_s, 0, -m_a_Y,  //
      0, m_s, m_a_X,      //
      -m_a_Y, m_a_X, robot.I_s;
  M_v_inverse = M_v.inverse();
  for (int k = 0; k < 3; ++k) columns_[k] << M_v.col(k).array(), 0;
  turning_ = {Wheels{0, -m_s, -m_a_X, 0}, Wheels{m_s, 0, -m_a_Y, 0}, Wheels{m_a_X, m_a_Y, 0, 0}};
}

double kinetic_energy(const RobotParameters& robot, const State& state) {
  const double V_X = state.V_X(), V_Y = state.V_Y(), Omega = state.Omega();
  return 0.5 * robot.m_s() * (V_X * V_X + V_Y * V_Y) + 0.5 * robot.I_s * Omega * Omega +
         robot.m * Omega * (robot.a_X * V_Y - robot.a_Y * V_X) + 0.5 * robot.J_1 * state.dphi().square().sum() +
         0.5 * robot.J_2 * state.dgamma().square().sum();
}

}  // namespace youbot_base_sim
