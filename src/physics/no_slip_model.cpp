#include "youbot_base_sim/physics/no_slip_model.h"

namespace youbot_base_sim {

namespace {

/// A' diag(weights) A
Eigen::Matrix3d weighted_square(const Eigen::Matrix<double, kWheels, 3>& A, const Wheels& weights) {
  return product(A.transpose(), weights.matrix().asDiagonal() * A);
}

}  // namespace

NoSlipModel::NoSlipModel(const RobotParameters& bare, const FloorParameters& floor, const AppliedLoads& applied)
    : robot_(loaded(bare, applied.loads)),
      platform_(robot_),
      dry_(robot_),
      kinematics_(robot_),
      external_(robot_, floor, applied.wrenches) {
  const RobotParameters& robot = robot_;
  const Wheels tan = robot.tan_delta();
  rolling_ << Eigen::Vector4d::Ones(), tan.matrix(), (robot.rho_X() * tan - robot.rho_Y()).matrix();
  rolling_ /= robot.R;
  roller_rolling_ << Eigen::Vector4d::Zero(), Eigen::Vector4d::Ones(), robot.rho_X().matrix();
  roller_rolling_.array().colwise() /= (robot.R_d - robot.R) * robot.cos_delta();
  inertia_ = platform_.M_v + weighted_square(rolling_, Wheels::Constant(robot.J_1));
  inertia_inverse_ = inverse(inertia_);
  damping_ = weighted_square(rolling_, robot.mu_1) + weighted_square(roller_rolling_, robot.mu_2);
}

Eigen::Vector3d NoSlipModel::dry_friction(const Eigen::Vector3d& v) const {
  return product(rolling_.transpose(), dry_.wheels.torque(dphi(v)).matrix()) +
         product(roller_rolling_.transpose(), dry_.rollers.torque(dgamma(v)).matrix());
}

Eigen::Matrix3d NoSlipModel::dry_damping(const Eigen::Vector3d& v) const {
  return weighted_square(rolling_, dry_.wheels.damping(dphi(v))) +
         weighted_square(roller_rolling_, dry_.rollers.damping(dgamma(v)));
}

Eigen::Vector3d NoSlipModel::bias(const Eigen::Vector3d& v) const {
  const Eigen::Vector3d viscous = product(damping_, v) - platform_.coriolis({v[0], v[1], v[2], 0}).head<3>().matrix();
  return dry_.any() ? Eigen::Vector3d(viscous + dry_friction(v)) : viscous;
}

Eigen::Vector3d NoSlipModel::acceleration(const Eigen::Vector3d& v, const Wheels& M,
                                          const Eigen::Vector3d& external) const {
  return product(inertia_inverse_, product(rolling_.transpose(), M.matrix()) - bias(v) + external);
}

Wheels NoSlipModel::torque(const Eigen::Vector3d& v, const Eigen::Vector3d& dv) const {
  return kinematics_.torque(product(inertia_, dv) + bias(v));
}

void NoSlipModel::derivative(const State& state, const Wheels& M, State& derivative) const {
  const Eigen::Vector3d v = state.velocity();
  const auto [sin_psi, cos_psi] = sine_and_cosine(state.psi());
  derivative.values.setZero();
  derivative.x() = v[0] * cos_psi - v[1] * sin_psi;
  derivative.y() = v[0] * sin_psi + v[1] * cos_psi;
  derivative.psi() = v[2];
  derivative.work() = sum(M * dphi(v)) - product(v.transpose(), product(damping_, v)).value();
  if (dry_.any()) derivative.work() -= product(v.transpose(), dry_friction(v)).value();
  const Eigen::Vector3d force = external_force(state.psi());
  derivative.work() += product(v.transpose(), force).value();
  derivative.values.col(1).head<3>() = acceleration(v, M, force).array();
  derivative.phi() = dphi(v);
  derivative.gamma() = dgamma(v);
}

void NoSlipModel::constrain(State& state) const {
  const Eigen::Vector3d v = state.velocity();
  state.dphi() = dphi(v);
  state.dgamma() = dgamma(v);
}

double NoSlipModel::max_decay_rate() const {
  const Eigen::Matrix3d rates = product(inertia_inverse_, damping_ + dry_damping(Eigen::Vector3d::Zero()));
  return rates(0, 0) + rates(1, 1) + rates(2, 2);
}

}  // namespace youbot_base_sim
