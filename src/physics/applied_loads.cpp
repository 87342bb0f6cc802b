#include "youbot_base_sim/physics/applied_loads.h"

namespace youbot_base_sim {

RobotParameters loaded(const RobotParameters& robot, const std::vector<Load>& loads) {
  RobotParameters sum = robot;
  Eigen::Vector3d moment = robot.m * Eigen::Vector3d{robot.a_X, robot.a_Y, robot.a_Z};
  for (const Load& load : loads) {
    sum.m += load.mass;
    moment += load.mass * load.position;
    const double p_X = load.position[0], p_Y = load.position[1];
    sum.I_s += load.inertia + load.mass * (p_X * p_X + p_Y * p_Y);
  }
  if (loads.empty()) return sum;  // to the last bit
  sum.a_X = moment[0] / sum.m;
  sum.a_Y = moment[1] / sum.m;
  sum.a_Z = moment[2] / sum.m;
  return sum;
}

namespace {

// Adds the wrench with the force W in the platform's frame.
void add(const Wrench& wrench, const Eigen::Vector3d& W, ExternalForce& sum) {
  const Eigen::Vector3d& p = wrench.point;
  sum.v += Wheels{W[0], W[1], p[0] * W[1] - p[1] * W[0] + wrench.torque, 0};
  sum.down -= W[2];
  sum.pitch += p[2] * W[0] - p[0] * W[2];
  sum.roll += p[2] * W[1] - p[1] * W[2];
}

}  // namespace

ExternalForces::ExternalForces(const RobotParameters& robot, const FloorParameters& floor,
                               const std::vector<Wrench>& wrenches)
    : m_s_(robot.m_s()),
      m_a_X_(robot.m * robot.a_X),
      m_a_Y_(robot.m * robot.a_Y),
      along_x_(-floor.g * sine_and_cosine(floor.slope).sine * sine_and_cosine(floor.uphill).cosine),
      along_y_(-floor.g * sine_and_cosine(floor.slope).sine * sine_and_cosine(floor.uphill).sine),
      normal_(floor.g * sine_and_cosine(floor.slope).cosine) {
  for (const Wrench& wrench : wrenches) {
    if (wrench.fixed) {
      fixed_.push_back(wrench);
    } else {
      add(wrench, wrench.force, steady_);
    }
  }
  by_heading_ = floor.slope != 0 || !fixed_.empty();
}

ExternalForce ExternalForces::sum(double cosine, double sine) const {
  ExternalForce sum = steady_;
  sum.g_X = cosine * along_x_ + sine * along_y_;
  sum.g_Y = cosine * along_y_ - sine * along_x_;
  sum.v += Wheels{m_s_ * sum.g_X, m_s_ * sum.g_Y, m_a_X_ * sum.g_Y - m_a_Y_ * sum.g_X, 0};
  for (const Wrench& wrench : fixed_) {
    const Eigen::Vector3d& W = wrench.force;
    add(wrench, {cosine * W[0] + sine * W[1], cosine * W[1] - sine * W[0], W[2]}, sum);
  }
  return sum;
}

}  // namespace youbot_base_sim
