#pragma once

#include "youbot_base_sim/drive/prescribed_wheels.h"

namespace youbot_base_sim {

/// The cubic between the angles (rad) and rates (rad/s) of the wheels at two instants.
struct WheelCubic : WheelMotion {
  double start = 0, length = 1;                        ///< s
  Wheels phi = Wheels::Zero(), dphi = Wheels::Zero();  ///< at the start
  Wheels moved = Wheels::Zero();                       ///< rad
  Wheels end_dphi = Wheels::Zero();

  Wheels angle(double t) const override {
    const double s = share(t);
    return phi + s * (length * dphi + s * (quadratic() + s * cubic()));
  }
  Wheels rate(double t) const override {
    const double s = share(t);
    return dphi + s / length * (2 * quadratic() + 3 * s * cubic());
  }
  Wheels acceleration(double t) const override {
    return (2 * quadratic() + 6 * share(t) * cubic()) / (length * length);
  }

 private:
  double share(double t) const { return (t - start) / length; }
  Wheels quadratic() const { return 3 * moved - length * (2 * dphi + end_dphi); }
  Wheels cubic() const { return length * (dphi + end_dphi) - 2 * moved; }
};

}  // namespace youbot_base_sim
