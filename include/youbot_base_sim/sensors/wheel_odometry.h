#pragma once

#include <Eigen/Dense>

#include "youbot_base_sim/drive/driver_kinematics.h"
#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/state.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Pose of the base as the driver integrates it from wheel angles: one Euler step a call, at the new heading; at 50 Hz.
///
/// The covariances model inexact wheel radii and slip: each wheel has two relative errors, one constant and one that
/// changes from rotation to rotation, both with a standard deviation of `wheel_error`. The rounding of encoder ticks
/// and of rpm is added. With a `wheel_error` of 0 the covariances are zero, as the driver's are.
class WheelOdometry {
 public:
  using Covariance = Eigen::Matrix3d;  ///< of x, y (m), heading (rad) or V_X, V_Y (m/s), Omega (rad/s)

  /// Starts at pose zero, with the wheels at angles phi (rad).
  WheelOdometry(const DriverKinematics& kinematics, const Wheels& phi, double wheel_error = 0, const Motor& motor = {});

  /// Advances to wheel angles phi, rad.
  void update(const Wheels& phi);

  /// Sets the pose back to zero, with the wheels at angles phi (rad).
  void reset(const Wheels& phi);

  /// The wheels' angles were set, by so much, rad: that is no motion.
  void carry(const Wheels& change) { phi_ += change; }

  /// x, y (m) and heading (rad, unwrapped) in the frame of the initial pose.
  const Eigen::Vector3d& pose() const { return pose_; }

  /// True if the covariances are anything but zero.
  bool has_covariance() const { return wheel_error_ > 0; }

  /// Covariance of `pose`, in its frame.
  Covariance pose_covariance() const;

  /// Covariance of `kinematics().velocity(dphi)`, in the frame of the base, at wheel rates `dphi` (rad/s).
  Covariance velocity_covariance(const Wheels& dphi) const;

  const DriverKinematics& kinematics() const { return kinematics_; }

 private:
  using Jacobian = DriverKinematics::Jacobian;

  void update_covariance(const Wheels& rolled, const Eigen::Vector3d& moved);

  DriverKinematics kinematics_;
  Rolling rolling_ = kinematics_.rolling();
  double wheel_error_;
  double tick_, rpm_;  // rad, rad/s
  Wheels phi_;
  Eigen::Vector3d pose_ = Eigen::Vector3d::Zero();
  Jacobian sensitivity_ = Jacobian::Zero();   // of the pose to each wheel's constant share
  Covariance changing_ = Covariance::Zero();  // of the pose, on account of the other ones
};

}  // namespace youbot_base_sim
