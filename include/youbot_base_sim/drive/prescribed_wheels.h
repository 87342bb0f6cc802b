#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "youbot_base_sim/drive/torque_profiles.h"
#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/parameters.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Angles of the wheels as a function of time, s. It may change while a simulation stands at that time.
class WheelMotion {
 public:
  virtual ~WheelMotion() = default;
  virtual Wheels angle(double t) const = 0;                    ///< rad
  virtual Wheels rate(double t) const = 0;                     ///< its derivative, rad/s, which must be continuous
  virtual Wheels acceleration(double t) const = 0;             ///< rad/s^2
  virtual double max_step(double) const { return kInfinity; }  ///< as TorqueProfile's, s
};

/// Wheel angles over time (rad, s): the smoothest function, in the mean square of its acceleration, through the rows of
/// a table or within the resolution of encoders of them: a natural cubic spline.
class WheelSpline : public WheelMotion {
 public:
  /// The readings of encoders of this `resolution` (rad) lie within half of it around the angles, so their errors have
  /// the standard deviation resolution / sqrt(12): the spline departs from each wheel's rows by as much in the mean, if
  /// smoothness asks for it. 0: it passes through all rows. Linear before the first row and after the last.
  explicit WheelSpline(WheelTable table, double resolution = 0);

  Wheels angle(double t) const override;
  Wheels rate(double t) const override;
  Wheels acceleration(double t) const override;
  double max_step(double t) const override;  ///< to the second row after t

  const WheelTable& table() const { return table_; }

 private:
  /// The place of a time between two rows.
  struct Place {
    std::size_t row;  ///< the first of them
    double length;    ///< between them, s
    double share;     ///< of it that has passed
  };
  Place place(double time) const;

  WheelTable table_;
  std::vector<Wheels> angle_, acceleration_;  // at the rows
};

/// Torque that moves the wheels as prescribed, on a robot whose friction does not act back on them: what their inertia
/// needs, and a damping towards the prescribed rate, by which errors of the integration decay.
class PrescribedWheels : public TorqueProfile {
 public:
  PrescribedWheels(const RobotParameters& robot, std::shared_ptr<const WheelMotion> motion);

  /// The robot whose wheels these torques move.
  static RobotParameters driven(const RobotParameters& robot);

  Wheels value(double t) const override;
  double max_step(double t) const override { return motion_->max_step(t); }
  bool prescribes_wheels() const override { return true; }

  /// Torque of the drives of `robot` at time t (s), N m: at wheel rates dphi (rad/s) under the friction F_X (N).
  Wheels reaction(const RobotParameters& robot, const Wheels& dphi, const Wheels& F_X, double t) const;

 private:
  std::shared_ptr<const WheelMotion> motion_;
  double J_1_;
};

}  // namespace youbot_base_sim
