#pragma once

#include <Eigen/Dense>
#include <array>

namespace youbot_base_sim {

constexpr int kWheels = 4;

/// One number for each wheel, in the order of the paper and of the driver: front-left, front-right, rear-left,
/// rear-right. Its four entries are also the four lanes in which the physics is computed.
using Wheels = Eigen::Array<double, kWheels, 1>;

/// Suffixes of the driver's joint names in wheel order: `wheel_joint_fl` and so on.
constexpr std::array<const char*, kWheels> kWheelNames = {"fl", "fr", "bl", "br"};

/// What the equations of motion integrate. Kept as one fixed-size array, so that a stepper's sums are plain arithmetic
/// on `values`; a column holds four numbers that are computed together.
///
///   column  0     x, y (m), psi (rad, unwrapped): pose of O in the fixed frame; row 3: work (J)
///           1     V_X, V_Y (m/s), Omega (rad/s): velocity in the platform's frame; row 3: unused, zero
///           2..5  phi (rad), dphi (rad/s), dgamma (rad/s), gamma (rad), one row for each wheel
///
/// `work` is the integral of the power of all torques and friction forces since the start: it mirrors the change of
/// kinetic energy and so audits the integration. `gamma` is the angle of the roller in contact.
struct State {
  using Values = Eigen::Array<double, 4, 6>;
  Values values = Values::Zero();

  double& x() { return values(0, 0); }
  double& y() { return values(1, 0); }
  double& psi() { return values(2, 0); }
  double& work() { return values(3, 0); }
  double& V_X() { return values(0, 1); }
  double& V_Y() { return values(1, 1); }
  double& Omega() { return values(2, 1); }
  auto phi() { return values.col(2); }
  auto dphi() { return values.col(3); }
  auto dgamma() { return values.col(4); }
  auto gamma() { return values.col(5); }

  double x() const { return values(0, 0); }
  double y() const { return values(1, 0); }
  double psi() const { return values(2, 0); }
  double work() const { return values(3, 0); }
  double V_X() const { return values(0, 1); }
  double V_Y() const { return values(1, 1); }
  double Omega() const { return values(2, 1); }
  auto phi() const { return values.col(2); }
  auto dphi() const { return values.col(3); }
  auto dgamma() const { return values.col(4); }
  auto gamma() const { return values.col(5); }

  /// (V_X, V_Y, Omega)
  Eigen::Vector3d velocity() const { return values.col(1).head<3>().matrix(); }
};

}  // namespace youbot_base_sim
