#pragma once

#include <algorithm>
#include <cmath>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Errors that a step may make: relative to a velocity, and absolute (a value in SI units for every component).
struct Tolerance {
  double relative;
  double absolute;
};

/// A share of it, as far as rounding lets steps keep to it.
inline Tolerance share_of(const Tolerance& tolerance, double share) {
  constexpr double kFinest = 1e-14;
  return {std::max(share * tolerance.relative, kFinest), share * tolerance.absolute};
}

constexpr double kRollerScale = 10;

/// Errors of the velocities u that count as 1, m/s and rad/s. The platform's are judged together, 1 rad/s as 1 m/s. A
/// roller's rate counts a `roller_scale`-th: its bearing stops an error within 1e-7 s, and the impulse that remains is
/// tiny.
inline Velocities error_scale(const Tolerance& tolerance, const Velocities& u, double roller_scale = kRollerScale) {
  return {Wheels::Constant(tolerance.absolute + tolerance.relative * std::sqrt(sum(u.v.square()))),
          tolerance.absolute + tolerance.relative * u.dphi.abs(),
          roller_scale * (tolerance.absolute + tolerance.relative * u.dgamma.abs())};
}

/// Root of the mean square of an error in units of its scale, over the eleven velocities.
inline double error_norm(const Velocities& error, const Velocities& scale) {
  return std::sqrt(
      sum((error.v / scale.v).square() + (error.dphi / scale.dphi).square() + (error.dgamma / scale.dgamma).square()) /
      11);
}

}  // namespace youbot_base_sim
