#pragma once

#include <array>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Torque of the four wheel drives as a function of time, N m, in smooth segments. One segment counts at a time, also
/// at its end, so that a step which ends there does not see the jump to the next one.
class TorqueProfile {
 public:
  virtual ~TorqueProfile() = default;

  /// Begins the segment that holds at time t (s), its start included. Returns where it ends, s; infinity if never.
  virtual double begin_segment([[maybe_unused]] double t) { return kInfinity; }

  /// Torque of the segment that was begun last at time t (s), also beyond its end, N m.
  virtual Wheels value(double t) const = 0;
  /// The torque at three times at once, with the bits of `value`.
  virtual std::array<Wheels, 3> values(const std::array<double, 3>& t) const {
    return {value(t[0]), value(t[1]), value(t[2])};
  }

  /// The longest step from time t in whose few stages a method sees how the torque of this segment changes, s; infinity
  /// if any does.
  virtual double max_step([[maybe_unused]] double t) const { return kInfinity; }

  /// True if the drives exert the reaction of the floor's friction besides, however large: wheels then rotate as
  /// prescribed, and friction does not act back on them.
  virtual bool prescribes_wheels() const { return false; }

 protected:
  static constexpr double kShareOfPeriod = 0.125;  ///< of a periodic torque, as one step
};

/// A constant torque until it is set anew.
class HeldTorque : public TorqueProfile {
 public:
  explicit HeldTorque(const Wheels& torque = Wheels::Zero()) : torque_(torque) {}
  void set(const Wheels& torque) { torque_ = torque; }
  Wheels value(double) const override { return torque_; }

 private:
  Wheels torque_;
};

}  // namespace youbot_base_sim
