#pragma once

#include <cstddef>
#include <vector>

#include "youbot_base_sim/drive/torque_profiles.h"
#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/parameters.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Wheel angles over time (rad, s): the smoothest twice differentiable function, in the mean square of its
/// acceleration, through the rows of a table, or that stays within the resolution of encoders of them: a natural cubic
/// spline.
class WheelSpline {
 public:
  /// The readings of encoders of this `resolution` (rad) lie within half of it around the angles, so their errors have
  /// the standard deviation resolution / sqrt(12): the spline departs from each wheel's rows by as much in the mean, if
  /// smoothness asks for it. 0: it passes through all rows. Linear before the first row and after the last.
  explicit WheelSpline(const WheelTable& table, double resolution = 0);

  Wheels angle(double t) const;         ///< rad
  Wheels rate(double t) const;          ///< rad/s
  Wheels acceleration(double t) const;  ///< rad/s^2

 private:
  /// Where a time is between two rows.
  struct Place {
    std::size_t row;  ///< the first of them
    double length;    ///< between them, s
    double share;     ///< of it that has passed
  };
  Place place(double t) const;

  std::vector<double> t_;
  std::vector<Wheels> angle_, acceleration_;  // at the rows
  mutable std::size_t row_ = 0;               // of the last time asked for: the next one is near
};

/// Torque that moves the wheels as prescribed, on a robot whose friction does not act back on them: what their inertia
/// needs, and a damping towards the prescribed rate, by which errors of the integration decay.
class PrescribedWheels : public TorqueProfile {
 public:
  PrescribedWheels(const RobotParameters& robot, WheelSpline spline);

  /// The robot whose wheels these torques move.
  static RobotParameters driven(const RobotParameters& robot);

  Wheels value(double t) const override;

  /// Torque of the drives of `robot` at time t (s), N m: where its wheels have the rates dphi (rad/s) and the floor
  /// exerts the friction F_X (N) on them.
  Wheels reaction(const RobotParameters& robot, const Wheels& dphi, const Wheels& F_X, double t) const;

 private:
  WheelSpline spline_;
  double J_1_;
};

}  // namespace youbot_base_sim
