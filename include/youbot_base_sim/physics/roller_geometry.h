#pragma once

#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

/// Where a roller touches the floor, and how that changes with the wheel's angle; one entry for each wheel. A prime is
/// the derivative by phi.
struct ContactGeometry {
  Wheels Delta_Y;   ///< offset of the contact point along the wheel's axle, m (3.4)
  Wheels dDelta_Y;  ///< Delta_Y', m/rad
  Wheels r_X;       ///< r sin(delta): what a unit dgamma takes from V_PX, m
  Wheels dr_X;      ///< r_X'
  Wheels r_Y;       ///< r cos(phi~) cos(delta): what a unit dgamma adds to V_PY, m
  Wheels dr_Y;      ///< r_Y'
};

/// Shape of a Mecanum wheel with n rollers that touch the cylinder of radius R from within (paper, sections 2 and 3).
class RollerGeometry {
 public:
  explicit RollerGeometry(const RobotParameters& robot);

  /// Contact point for rollers that stand `phi_tilde` (rad) away from straight down; finite for |phi~| < pi/2.
  ContactGeometry at(const Wheels& phi_tilde) const {
    const Wheels sine = phi_tilde.sin();
    const Wheels cosine = phi_tilde.cos();
    const Wheels secant = 1 / cosine;
    ContactGeometry g;
    g.Delta_Y = R_d_tan_delta_ * (sine * secant);
    g.dDelta_Y = R_d_tan_delta_ * (secant * secant);
    g.r_X = sin_delta_ * (R_ - R_d_ * secant);
    g.dr_X = -sin_delta_ * R_d_ * (sine * secant * secant);
    g.r_Y = cos_delta_ * (R_ * cosine - R_d_);
    g.dr_Y = -cos_delta_ * R_ * sine;
    return g;
  }

  /// Angle from one roller to the next, 2 pi / n, rad.
  double pitch() const { return pitch_; }

  /// Unwrapped number of the roller on the floor at wheel angle `phi` (rad): roller k for phi~ in [-pi/n, pi/n), where
  /// phi = k pitch + phi~ (2.1). Roller k and roller k + n are the same one.
  int roller_at(double phi) const;

  /// Wheel angle at which roller k hands over to roller k + 1, rad.
  double upper_edge(int k) const { return (k + 0.5) * pitch_; }

 private:
  double pitch_;
  double R_;
  double R_d_;
  Wheels R_d_tan_delta_;
  Wheels sin_delta_;
  double cos_delta_;
};

}  // namespace youbot_base_sim
