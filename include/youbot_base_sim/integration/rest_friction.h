#pragma once

#include <array>
#include <cstddef>

#include "youbot_base_sim/physics/parameters.h"
#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Owns the slip speed over which friction is regularized: nu while the base moves, the holding speed while it rests,
/// and the geometric mean of kSlow and the holding speed in between. A parked base creeps at about that speed; while
/// the base is slow, a small one costs nothing. The rate that smooths the dry friction of the drives shrinks by the
/// same share, so that motors at rest keep their torque, as those of real bases do.
///
/// The speed changes to the next smaller one once the base is slower than kRests times the present one, and to the next
/// larger one once it is faster than kMoves times that. Where rollers let a base move, its contacts slip at cos 45 deg
/// of its speed: at kRests = 5 they carry 5 cos 45 deg / sqrt(1 + (5 cos 45 deg)^2) = 96 % of their limit. A load that
/// cannot take the base from one threshold to the other changes nothing. The mean is there because a step may jump over
/// the end of a stop, and with it over the energy that is left then.
///
/// A nu above kSlow counts as kSlow here: a base that creeps by such a nu moves.
class RestFriction {
 public:
  static constexpr double kSlow = 1e-3;  ///< m/s

  /// Speeds in m/s. A base that moves at first, and for ever if `nu` is infinite, or `holding` 0 or not less than nu
  /// and kSlow.
  RestFriction(const RobotParameters& robot, double nu, double holding);

  /// True if there is a level to change to.
  bool holds() const { return holds_; }
  /// Distance of the velocities u past the next change of level, m/s; negative before it, and without holding speed.
  double margin(const Velocities& u) const {
    // O is no faster than the fastest wheel's centre.
    if (!holds_ || keeps_moving(u.v[0] * u.v[0] + u.v[1] * u.v[1])) return -1;
    return past_change(speed(u));
  }
  /// True if the level of a base that `holds` may change on the way from velocities u to w: a quick look.
  bool may_change(const Velocities& u, const Velocities& w) const;
  /// Changes the level; `margin` must be positive.
  void change(const Velocities& u);

  double moving_nu() const { return nu_; }                           ///< while the base moves, m/s
  double nu() const { return level_ == 0 ? nu_ : speeds_[level_]; }  ///< now, m/s
  double dry_friction_rate() const;                                  ///< of the drives now, rad/s

 private:
  static constexpr double kRests = 5, kMoves = 10;

  bool keeps_moving(double square) const { return level_ == 0 && square > kRests * kRests * speeds_[0] * speeds_[0]; }
  double past_slower(double speed) const { return level_ + 1 < speeds_.size() ? kRests * speeds_[level_] - speed : -1; }
  double past_faster(double speed) const { return level_ > 0 ? speed - kMoves * speeds_[level_ - 1] : -1; }
  double past_change(double speed) const;
  double speed(const Velocities& u) const;

  double nu_;
  std::array<double, 3> speeds_;  // of the thresholds, and but for the first of friction, m/s
  std::size_t level_ = 0;         // the present one of speeds_
  bool holds_;
  Wheels rho_X_, rho_Y_;
  double R_;
  double dry_friction_rate_;  // of the robot, rad/s
  bool holds_drives_;         // true if their dry friction is about at its limit where the base begins to rest
};

}  // namespace youbot_base_sim
