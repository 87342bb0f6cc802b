#include "youbot_base_sim/physics/no_slip_model.h"

#include <cmath>

namespace youbot_base_sim {

NoSlipModel::NoSlipModel(const RobotParameters& robot) : robot_(robot), platform_(robot), dry_(robot) {
  const Wheels tan = tan_delta();
  rolling_ << Eigen::Vector4d::Ones(), tan.matrix(), (robot.rho_X() * tan - robot.rho_Y()).matrix();
  rolling_ /= robot.R;
  roller_rolling_ << Eigen::Vector4d::Zero(), Eigen::Vector4d::Ones(), robot.rho_X().matrix();
  roller_rolling_ /= (robot.R_d - robot.R) * kCosDelta;
  inertia_ = platform_.M_v + robot.J_1 * rolling_.transpose() * rolling_;
  damping_ = rolling_.transpose() * robot.mu_1.matrix().asDiagonal() * rolling_ +
             roller_rolling_.transpose() * robot.mu_2.matrix().asDiagonal() * roller_rolling_;
}

NoSlipModel::NoSlipModel(const RobotParameters& robot, const FloorParameters& floor, const AppliedLoads& applied)
    : NoSlipModel(loaded(robot, applied.loads)) {
  if (floor.slope != 0 || !applied.wrenches.empty()) external_.emplace(robot_, floor, applied.wrenches);
}

Eigen::Vector3d NoSlipModel::dry_friction(const Eigen::Vector3d& v) const {
  return rolling_.transpose() * dry_.wheel_torque(dphi(v)).matrix() +
         roller_rolling_.transpose() * dry_.roller_torque(dgamma(v)).matrix();
}

Eigen::Matrix3d NoSlipModel::dry_damping(const Eigen::Vector3d& v) const {
  return rolling_.transpose() * dry_.wheel_damping(dphi(v)).matrix().asDiagonal() * rolling_ +
         roller_rolling_.transpose() * dry_.roller_damping(dgamma(v)).matrix().asDiagonal() * roller_rolling_;
}

Eigen::Vector3d NoSlipModel::bias(const Eigen::Vector3d& v) const {
  const Eigen::Vector3d viscous = damping_ * v - platform_.coriolis({v[0], v[1], v[2], 0}).head<3>().matrix();
  return dry_.any() ? Eigen::Vector3d(viscous + dry_friction(v)) : viscous;
}

Eigen::Vector3d NoSlipModel::bias_rate(const Eigen::Vector3d& v, const Eigen::Vector3d& dv) const {
  const PlatformMatrix C = platform_.coriolis_derivative({v[0], v[1], v[2], 0});
  const Eigen::Vector3d viscous = damping_ * dv - (C[0] * dv[0] + C[1] * dv[1] + C[2] * dv[2]).head<3>().matrix();
  return dry_.any() ? Eigen::Vector3d(viscous + dry_damping(v) * dv) : viscous;
}

Wheels NoSlipModel::distribute(const Eigen::Vector3d& force) const {
  const double M_X = robot_.R * force[0], M_Y = robot_.R * force[1];
  const double turn = robot_.R / (robot_.h + robot_.l) * force[2];
  return Wheels{M_X - M_Y - turn, M_X + M_Y + turn, M_X + M_Y - turn, M_X - M_Y + turn} / 4;
}

Eigen::Vector3d NoSlipModel::acceleration(const Eigen::Vector3d& v, const Wheels& M,
                                          const Eigen::Vector3d& external) const {
  return inertia_.llt().solve(rolling_.transpose() * M.matrix() - bias(v) + external);
}

Wheels NoSlipModel::torque(const Eigen::Vector3d& v, const Eigen::Vector3d& dv) const {
  return distribute(inertia_ * dv + bias(v));
}

Wheels NoSlipModel::torque_rate(const Eigen::Vector3d& v, const Eigen::Vector3d& dv, const Eigen::Vector3d& ddv) const {
  return distribute(inertia_ * ddv + bias_rate(v, dv));
}

void NoSlipModel::derivative(const State& state, const Wheels& M, State& derivative) const {
  const Eigen::Vector3d v = state.velocity();
  const double cos_psi = std::cos(state.psi()), sin_psi = std::sin(state.psi());
  derivative.values.setZero();
  derivative.x() = v[0] * cos_psi - v[1] * sin_psi;
  derivative.y() = v[0] * sin_psi + v[1] * cos_psi;
  derivative.psi() = v[2];
  derivative.work() = (M * dphi(v)).sum() - v.dot(damping_ * v);
  if (dry_.any()) derivative.work() -= v.dot(dry_friction(v));
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  if (external_) {
    force = external(state.psi());
    derivative.work() += v.dot(force);
  }
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
  return inertia_.llt().solve(damping_ + dry_damping(Eigen::Vector3d::Zero())).trace();
}

void NoSlipModel::jacobian(const State& state, const Wheels& M, const Wheels& M_rate, StateJacobian& J,
                           State& dfdt) const {
  const Eigen::Vector3d v = state.velocity();
  const Eigen::Matrix3d damping = damping_ + dry_damping(v);
  const PlatformMatrix C = platform_.coriolis_derivative({v[0], v[1], v[2], 0});
  Eigen::Matrix3d coriolis;
  coriolis << C[0].head<3>().matrix(), C[1].head<3>().matrix(), C[2].head<3>().matrix();
  const auto inverse = inertia_.llt();
  const Eigen::Matrix3d by_v = inverse.solve(coriolis - damping);
  const Eigen::Vector3d power_by_v = rolling_.transpose() * M.matrix() - damping_ * v - damping_.transpose() * v -
                                     dry_friction(v) - dry_damping(v).transpose() * v;
  const double cos_psi = std::cos(state.psi()), sin_psi = std::sin(state.psi());

  for (int row = 0; row < State::kSize; ++row) {
    for (int column = 0; column < State::kSize; ++column) J(row, column) = 0;
  }
  J(State::kX, State::kPsi) = -v[0] * sin_psi - v[1] * cos_psi;
  J(State::kY, State::kPsi) = v[0] * cos_psi - v[1] * sin_psi;
  J(State::kX, State::kV) = J(State::kY, State::kV + 1) = cos_psi;
  J(State::kX, State::kV + 1) = -sin_psi;
  J(State::kY, State::kV) = sin_psi;
  J(State::kPsi, State::kOmega) = 1;
  for (int k = 0; k < 3; ++k) {
    J(State::kWork, State::kV + k) = power_by_v[k];
    for (int row = 0; row < 3; ++row) J(State::kV + row, State::kV + k) = by_v(row, k);
    for (int i = 0; i < kWheels; ++i) {
      J(State::kPhi + i, State::kV + k) = rolling_(i, k);
      J(State::kGamma + i, State::kV + k) = roller_rolling_(i, k);
    }
  }
  if (external_) {
    constexpr double kStep = 1e-6;  // rad: forces are harmonics of psi
    const Eigen::Vector3d by_psi = (external(state.psi() + kStep) - external(state.psi() - kStep)) / (2 * kStep);
    const Eigen::Vector3d acceleration_by_psi = inverse.solve(by_psi);
    for (int row = 0; row < 3; ++row) {
      J(State::kV + row, State::kPsi) = acceleration_by_psi[row];
      J(State::kWork, State::kV + row) += external(state.psi())[row];
    }
    J(State::kWork, State::kPsi) = v.dot(by_psi);
  }
  dfdt.values.setZero();
  dfdt.work() = (M_rate * dphi(v)).sum();
  dfdt.values.col(1).head<3>() = inverse.solve(rolling_.transpose() * M_rate.matrix()).array();
}

}  // namespace youbot_base_sim
