#pragma once

#include <array>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// -d(forces)/d(velocities) at fixed positions, without the Coriolis forces: how friction and bearings resist motion.
/// One entry for each wheel; `platform_dphi[i]` is the force on platform velocity i by dphi, `dphi_platform[k]` that on
/// dphi by platform velocity k, and so on. Force per velocity in SI units.
struct alignas(kAlignment) DampingMatrix {
  std::array<std::array<Wheels, 3>, 3> platform_platform;
  std::array<Wheels, 3> platform_dphi, platform_dgamma;
  std::array<Wheels, 3> dphi_platform, dgamma_platform;
  Wheels dphi_dphi, dphi_dgamma, dgamma_dgamma;  ///< dgamma_dphi equals dphi_dgamma

  /// How strongly each contact resists slip: the trace of its stiffness, N s/m.
  Wheels contact_stiffness() const { return platform_platform[0][0] + platform_platform[1][1]; }

  /// Takes all entries of wheel i from `other`.
  void set_wheel(int i, const DampingMatrix& other) { columns().row(i) = other.columns().row(i); }

 private:
  static constexpr int kColumns = 24;
  Eigen::Map<Eigen::Array<double, kWheels, kColumns>> columns() {
    return Eigen::Map<Eigen::Array<double, kWheels, kColumns>>(platform_platform[0][0].data());
  }
  Eigen::Map<const Eigen::Array<double, kWheels, kColumns>> columns() const {
    return Eigen::Map<const Eigen::Array<double, kWheels, kColumns>>(platform_platform[0][0].data());
  }
};

static_assert(sizeof(DampingMatrix) == 24 * sizeof(Wheels));

}  // namespace youbot_base_sim
