#pragma once

#include <limits>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Torque of the four wheel drives as a function of time, in smooth pieces, N m. One piece is entered at a time: a step
/// that ends where the next one begins must not see it.
class WheelTorque {
 public:
  virtual ~WheelTorque() = default;

  /// Enters the piece that holds at time t (s), its start included. Returns where it ends, s; infinity if never.
  virtual double enter(double t) = 0;

  /// Torque of the entered piece at time t (s), also beyond its end, and its time derivative (N m/s).
  virtual Wheels at(double t) const = 0;
  virtual Wheels rate(double t) const = 0;
};

/// The same torque until it is set anew.
class HeldTorque : public WheelTorque {
 public:
  explicit HeldTorque(const Wheels& torque = Wheels::Zero()) : torque_(torque) {}
  void set(const Wheels& torque) { torque_ = torque; }
  double enter(double) override { return std::numeric_limits<double>::infinity(); }
  Wheels at(double) const override { return torque_; }
  Wheels rate(double) const override { return Wheels::Zero(); }

 private:
  Wheels torque_;
};

}  // namespace youbot_base_sim
