#include "youbot_base_sim/sensors/wheel_odometry.h"

#include <cmath>

namespace youbot_base_sim {

namespace {

/// Variance of a number that is rounded to a multiple of `step`.
double rounding_variance(double step) { return step * step / 12; }

}  // namespace

WheelOdometry::WheelOdometry(const DriverKinematics& kinematics, const Wheels& phi, double wheel_error,
                             const Motor& motor)
    : kinematics_(kinematics), wheel_error_(wheel_error), tick_(motor.tick()), rpm_(motor.rpm()), phi_(phi) {}

void WheelOdometry::update(const Wheels& phi) {
  const Wheels rolled = phi - phi_;
  phi_ = phi;
  const Eigen::Vector3d moved = rolling_.velocity(rolled);
  pose_[2] += moved[2];
  if (wheel_error_ > 0) update_covariance(rolled, moved);
  pose_ += turned({moved[0], moved[1], 0}, pose_[2]);
}

void WheelOdometry::update_covariance(const Wheels& rolled, const Eigen::Vector3d& moved) {
  constexpr double kRotation = 2 * M_PI;
  const auto [s, c] = sine_and_cosine(pose_[2]);
  // Derivatives of `update` by the previous pose and by each wheel's rotation, which acts along the new heading.
  Eigen::Matrix3d by_pose = Eigen::Matrix3d::Identity(), by_moved = Eigen::Matrix3d::Identity();
  by_pose(0, 2) = -s * moved[0] - c * moved[1];
  by_pose(1, 2) = c * moved[0] - s * moved[1];
  by_moved.topLeftCorner<2, 2>() << c, -s, s, c;
  by_moved.col(2) = by_pose.col(2);
  const Jacobian by_turning = product(by_moved, kinematics_.jacobian());
  sensitivity_ = product(by_pose, sensitivity_) + by_turning * rolled.matrix().asDiagonal();
  changing_ = product(product(by_pose, changing_), by_pose.transpose()) +
              product(by_turning * (kRotation * rolled.abs()).matrix().asDiagonal(), by_turning.transpose());
}

void WheelOdometry::reset(const Wheels& phi) {
  phi_ = phi;
  pose_.setZero();
  sensitivity_.setZero();
  changing_.setZero();
}

WheelOdometry::Covariance WheelOdometry::pose_covariance() const {
  if (wheel_error_ == 0) return Covariance::Zero();
  const Jacobian J = kinematics_.jacobian();
  return wheel_error_ * wheel_error_ * (product(sensitivity_, sensitivity_.transpose()) + changing_) +
         rounding_variance(tick_) * product(J, J.transpose());
}

WheelOdometry::Covariance WheelOdometry::velocity_covariance(const Wheels& dphi) const {
  if (wheel_error_ == 0) return Covariance::Zero();
  const Jacobian J = kinematics_.jacobian();
  const Wheels variance = 2 * (wheel_error_ * dphi).square() + rounding_variance(rpm_);  // two errors
  return product(J * variance.matrix().asDiagonal(), J.transpose());
}

}  // namespace youbot_base_sim
