#include "youbot_base_sim/physics/burden.h"

namespace youbot_base_sim {

RobotParameters loaded(const RobotParameters& robot, const std::vector<Load>& loads) {
  RobotParameters sum = robot;
  Eigen::Vector3d moment = robot.m * Eigen::Vector3d{robot.a_X, robot.a_Y, robot.a_Z};
  for (const Load& load : loads) {
    sum.m += load.mass;
    moment += load.mass * load.position;
    sum.I_s += load.inertia + load.mass * load.position.head<2>().squaredNorm();
  }
  if (loads.empty()) return sum;  // to the last bit
  sum.a_X = moment[0] / sum.m;
  sum.a_Y = moment[1] / sum.m;
  sum.a_Z = moment[2] / sum.m;
  return sum;
}

ExternalForce ExternalForces::sum(double psi) const {
  ExternalForce sum;
  sum.g_X = -along_ * std::cos(uphill_ - psi);
  sum.g_Y = -along_ * std::sin(uphill_ - psi);
  sum.v = {m_s_ * sum.g_X, m_s_ * sum.g_Y, m_a_X_ * sum.g_Y - m_a_Y_ * sum.g_X, 0};
  for (const Wrench& wrench : wrenches_) {
    Eigen::Vector3d W = wrench.force;
    if (wrench.fixed) {
      const double cosine = std::cos(psi), sine = std::sin(psi);
      W.head<2>() << cosine * wrench.force[0] + sine * wrench.force[1],
          cosine * wrench.force[1] - sine * wrench.force[0];
    }
    const Eigen::Vector3d& p = wrench.point;
    sum.v += Wheels{W[0], W[1], p[0] * W[1] - p[1] * W[0] + wrench.torque, 0};
    sum.down -= W[2];
    sum.pitch += p[2] * W[0] - p[0] * W[2];
    sum.roll += p[2] * W[1] - p[1] * W[2];
  }
  return sum;
}

}  // namespace youbot_base_sim
