#pragma once

#include <cstdint>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/parameters.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// The place at which a roller touches the floor; one entry for each wheel.
struct ContactGeometry {
  Wheels Delta_Y;  ///< offset of the contact point along the wheel's axle, m (3.4)
  Wheels r_X;      ///< r sin(delta): what a unit dgamma takes from V_PX, m
  Wheels r_Y;      ///< r cos(phi~) cos(delta): what a unit dgamma adds to V_PY, m
  Wheels dr_Y;     ///< its derivative by phi, m/rad
};

/// Number 0 .. n-1 of a roller by its unwrapped number, on a wheel of n.
inline int wrapped(std::int64_t roller, int n) { return static_cast<int>(((roller % n) + n) % n); }

/// Shape of a Mecanum wheel with n rollers that touch the cylinder of radius R from within (paper, sections 2 and 3).
class RollerGeometry {
 public:
  explicit RollerGeometry(const RobotParameters& robot);

  /// Contact point for rollers `phi_tilde` (rad) away from straight down; to rounding for |phi~| < 1.1.
  ContactGeometry at(const Wheels& phi_tilde) const {
    const auto [sine, cosine] = small_sine_and_cosine(phi_tilde);
    const Wheels secant = 1 / cosine;
    ContactGeometry g;
    g.Delta_Y = R_d_tan_delta_ * (sine * secant);
    g.r_X = sin_delta_ * (R_ - R_d_ * secant);
    g.r_Y = cos_delta_ * (R_ * cosine - R_d_);
    g.dr_Y = -cos_delta_ * R_ * sine;
    return g;
  }

  /// The mean over a roller, for wheels that pass rollers too fast to distinguish them; its derivative is zero.
  const ContactGeometry& mean() const { return mean_; }

  /// Radius of a roller where the next one takes over, m; negative if rollers taper to a point before they meet.
  double end_radius() const;

  /// Angle from one roller to the next, 2 pi / n, rad.
  double pitch() const { return pitch_; }

  /// Unwrapped number of the roller on the floor at wheel angle `phi` (rad): k with phi = k pitch + phi~, phi~ in
  /// [-pi/n, pi/n) (2.1). Rollers k and k + n are the same. Throws std::domain_error if k has more than 64 bits.
  std::int64_t roller_at(double phi) const;

  /// Wheel angle at which roller k hands over to roller k + 1, rad.
  double upper_edge(std::int64_t k) const { return (static_cast<double>(k) + 0.5) * pitch_; }

 private:
  double pitch_;
  double R_;
  double R_d_;
  alignas(kAlignment) Wheels R_d_tan_delta_;
  Wheels sin_delta_, cos_delta_;
  ContactGeometry mean_;
};

/// Wheel angles k = 0, 1, .. of an even spread over one roller of n, rad: Roberts' additive recurrence.
Wheels spread_angles(int k, int n);

}  // namespace youbot_base_sim
