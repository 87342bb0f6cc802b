#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "youbot_base_sim/physics/roller_geometry.h"
#include "youbot_base_sim/physics/roller_switch.h"

namespace youbot_base_sim {

/// The shares of two rollers in a wheel.
struct Sharing {
  double alpha;     ///< share of the upper roller; the contact holds while it lies in [0, 1]
  bool attractive;  ///< true if both rollers drive the wheel back to the edge between them
  double error;     ///< of the platform's speed if the wheel came to rest there now, m/s (docs/method.md)
  double kick;      ///< what the platform's speed loses each time a roller takes over at rest, m/s; else 0
};

/// The contact that each wheel has with the floor:
///   - on one roller, between that roller's two edges;
///   - shared between two rollers, on the edge between them (Filippov's sliding mode, see SharedContact);
///   - averaged over its rollers, when it passes them faster than they can be located.
class ContactModes {
 public:
  using Ids = Eigen::Array<std::int64_t, kWheels, 1, Eigen::DontAlign>;

  /// Each wheel stands on the roller at its angle `phi` (rad). Wheels that pass more than `max_located_rate` rollers a
  /// second are above the limit of location. Throws std::domain_error as RollerGeometry::roller_at does.
  ContactModes(const RobotParameters& robot, const Wheels& phi, double max_located_rate = kMaxLocatedRate);

  /// Wheel angles that bound each contact, [lower, upper), rad; infinite for shared and averaged contacts.
  const Wheels& lower_edge() const { return lower_edge_; }
  const Wheels& upper_edge() const { return upper_edge_; }

  /// Wheel angles at which the rollers in contact point straight down, rad; infinite for averaged contacts.
  const Wheels& center() const { return center_; }

  /// Shape of the contacts at the wheel angles `phi` (rad); of averaged ones, the mean.
  ContactGeometry geometry(const Wheels& phi) const {
    const ContactGeometry& mean = geometry_.mean();
    ContactGeometry g = geometry_.at(phi_tilde(phi));
    for (Wheels ContactGeometry::*entry :
         {&ContactGeometry::Delta_Y, &ContactGeometry::r_X, &ContactGeometry::r_Y, &ContactGeometry::dr_Y}) {
      g.*entry = averaged_.select(mean.*entry, g.*entry);
    }
    return g;
  }

  /// Angle of each wheel from where its roller points straight down, rad; 0 where the contact is averaged.
  Wheels phi_tilde(const Wheels& phi) const { return averaged_.select(Wheels::Zero(), phi - center_); }

  /// Unwrapped number of the roller on which wheel i stands; of two, the one that it reached last.
  std::int64_t roller(int i) const { return roller_[i]; }
  /// The lower one of the two rollers of a shared contact, unwrapped.
  std::int64_t lower_roller(int i) const { return lower_roller_[i]; }
  /// Unwrapped number of the roller on the floor at wheel angle `phi` (rad), whatever the contact.
  std::int64_t roller_at(double phi) const { return geometry_.roller_at(phi); }
  int rollers() const { return rollers_; }  ///< of a wheel

  bool on_one_roller(int i) const { return !shared_[i] && !averaged_[i]; }
  bool shared(int i) const { return shared_[i]; }
  bool averaged(int i) const { return averaged_[i]; }
  const WheelMask& shared() const { return shared_; }
  bool shares() const { return shares_; }      ///< true if some contact is shared
  bool averages() const { return averages_; }  ///< true if some contact is averaged
  bool mixed() const { return shares_ || averages_; }

  /// A number for each wheel that changes whenever its contact does.
  const Ids& ids() const { return ids_; }

  /// Angle about its own axis at which roller k (0 .. n-1) of wheel i left the floor, rad.
  double angle_off_floor(int i, int k) const { return angle_off_floor_[index(i, k)]; }

  /// Stands wheel i on roller k (unwrapped number).
  void set_roller(int i, std::int64_t k);

  /// Stands wheel i of state x on roller k instead of its own. The roller that leaves the floor keeps its angle; the
  /// new one starts at the angle that it left the floor with, and with the rate that RollerRateAtSwitch says.
  void switch_roller(int i, std::int64_t k, State& x);

  /// Stands wheel i, which rests at the upper edge of roller k, on rollers k and k + 1.
  void share(int i, std::int64_t k);

  /// Lets wheel i stay on its roller until it is `more` (rad) beyond an edge.
  void widen(int i, double more) {
    lower_edge_[i] -= more;
    upper_edge_[i] += more;
  }

  /// Averages the contact of wheel i over its rollers. They share gamma and dgamma; RollerRateAtSwitch has no effect.
  void enter_averaging(int i);

  /// The velocities of the base jump: for what follows all contacts are others than before.
  void renew() { ids_ += 1; }

  /// Moves the roller number of wheel i, whose contact is averaged, to the roller at the wheel's angle.
  void track_roller(int i, const State& x) { roller_[i] = roller_at(x.phi()[i]); }

  /// True if wheel i passes rollers too fast to locate its switches.
  bool above_location_limit(int i, const State& x) const { return std::abs(x.dphi()[i]) > max_located_dphi_; }
  /// Distance of wheel i below the rate at which an averaged contact is resolved again, rad/s.
  double below_resolution_limit(int i, const State& x) const { return min_averaged_dphi_ - std::abs(x.dphi()[i]); }

  /// The last angle of the roller's range before its edge, or the first one after it, in this direction (+1, -1), rad.
  static double far_side(double edge, int direction) { return direction > 0 ? edge : std::nextafter(edge, -kInfinity); }
  /// Moves the angle of wheel i, which is on one roller, into the roller's range.
  void keep_inside(int i, State& x) const;

 private:
  std::size_t index(int i, int k) const { return static_cast<std::size_t>(i * rollers_ + k); }
  void begin_contact(int i, bool shared, bool averaged, double center, double lower, double upper);

  RollerGeometry geometry_;
  alignas(kAlignment) Wheels center_;
  Wheels lower_edge_, upper_edge_;
  WheelMask shared_ = WheelMask::Constant(false), averaged_ = WheelMask::Constant(false);
  bool shares_ = false, averages_ = false;
  Ids ids_ = Ids::Zero();
  std::array<std::int64_t, kWheels> roller_{}, lower_roller_{};
  std::vector<double> angle_off_floor_;
  double max_located_dphi_, min_averaged_dphi_;  // rad/s
  int rollers_;
  double J_2_;
  RollerRateAtSwitch rate_at_switch_;
};

}  // namespace youbot_base_sim
