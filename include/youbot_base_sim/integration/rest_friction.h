#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace youbot_base_sim {

/// Decides over which slip speed friction is regularized: nu while the base moves, the holding speed while it rests,
/// and the geometric mean of kSlow and the holding speed in between. A parked base creeps at about that speed; while the
/// base is slow, a small one costs nothing. The rate that smooths the dry friction of the drives shrinks by the same
/// share, so that motors at rest keep their torque, as those of real bases do.
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

  /// Speeds in m/s. A base that moves at first, and for ever if `nu` is infinite or not more than `holding`.
  RestFriction(double nu, double holding)
      : nu_(nu),
        speeds_{std::min(nu, kSlow), std::sqrt(std::min(nu, kSlow) * holding), holding},
        holds_(std::isfinite(nu) && holding > 0 && holding < speeds_[0]) {}

  /// Whether there is a holding speed.
  bool holds() const { return holds_; }

  /// Whether a base that moves goes on to, at a speed of at least the root of `square`, m^2/s^2: a quick look.
  bool keeps_moving(double square) const { return level_ == 0 && square > kRests * kRests * speeds_[0] * speeds_[0]; }

  /// How far a base of this speed (m/s) is past the next change; negative before it.
  double past_change(double speed) const { return std::max(past_slower(speed), past_faster(speed)); }
  void change(double speed) { past_slower(speed) > past_faster(speed) ? ++level_ : --level_; }

  /// Regularizes friction over at least `speed` (m/s) from now on.
  void ease(double speed) { eased_ = speed; }

  /// The speed that decides whether a base moves: nu, but at most kSlow, m/s.
  double slow_speed() const { return speeds_[0]; }

  double regularization_speed() const { return std::max(eased_, level_ == 0 ? nu_ : speeds_[level_]); }

  /// Of that speed in nu; 1 while the base moves.
  double share() const { return level_ == 0 ? 1 : std::min(1.0, regularization_speed() / speeds_[0]); }

 private:
  static constexpr double kRests = 5, kMoves = 10;

  double past_slower(double speed) const { return level_ + 1 < speeds_.size() ? kRests * speeds_[level_] - speed : -1; }
  double past_faster(double speed) const { return level_ > 0 ? speed - kMoves * speeds_[level_ - 1] : -1; }

  double nu_;
  std::array<double, 3> speeds_;  // of the thresholds, and but for the first of friction, m/s
  double eased_ = 0;
  std::size_t level_ = 0;  // the present one of speeds_
  bool holds_;
};

}  // namespace youbot_base_sim
