#include "youbot_base_sim/physics/inertia.h"

namespace youbot_base_sim {

namespace {

Wheels column_of(const Eigen::Matrix3d& m, int k) { return {m(0, k), m(1, k), m(2, k), 0}; }

}  // namespace

Eigen::Matrix3d inverse(const Eigen::Matrix3d& m) {
  const PlatformMatrix columns = inverse({column_of(m, 0), column_of(m, 1), column_of(m, 2)});
  Eigen::Matrix3d inverse;
  for (int k = 0; k < 3; ++k) inverse.col(k) = columns[k].head<3>().matrix();
  return inverse;
}

Inertia::Inertia(const RobotParameters& robot) : J_1(robot.J_1), J_2(robot.J_2) {
  const double m_s = robot.m_s(), m_a_X = robot.m * robot.a_X, m_a_Y = robot.m * robot.a_Y;
  M_v << m_s, 0, -m_a_Y,  //
      0, m_s, m_a_X,      //
      -m_a_Y, m_a_X, robot.I_s;
  M_v_inverse = inverse(M_v);
  for (int k = 0; k < 3; ++k) columns_[k] = column_of(M_v, k);
  turning_ = {Wheels{0, -m_s, -m_a_X, 0}, Wheels{m_s, 0, -m_a_Y, 0}, Wheels{m_a_X, m_a_Y, 0, 0}};
}

double kinetic_energy(const RobotParameters& robot, const State& state) {
  const double V_X = state.V_X(), V_Y = state.V_Y(), Omega = state.Omega();
  return 0.5 * robot.m_s() * (V_X * V_X + V_Y * V_Y) + 0.5 * robot.I_s * Omega * Omega +
         robot.m * Omega * (robot.a_X * V_Y - robot.a_Y * V_X) + 0.5 * robot.J_1 * sum(state.dphi().square()) +
         0.5 * robot.J_2 * sum(state.dgamma().square());
}

}  // namespace youbot_base_sim
