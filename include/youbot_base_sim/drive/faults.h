#pragma once

#include <algorithm>
#include <array>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Faults between the software that commands the base and its wheels; none by default.
struct Faults {
  /// The EtherCAT cable is unplugged. After 100 cycles of 1 ms the driver gives up the base, and the motors' own
  /// time-out switches them off. When the cable is back, the driver reconnects only on request.
  bool ethercat_lost = false;
  /// These motors do not answer: readings freeze, set points do not arrive, and after their time-out they switch off.
  std::array<bool, kWheels> silent{};
  /// Share of a wheel's rotation that its encoder misses, 0 .. 1, as if it slipped on its shaft.
  Wheels encoder_slip = Wheels::Zero();
  /// Standard deviation of the noise in each encoder reading, rad of the wheel.
  double encoder_noise = 0;
  /// Time between a command's arrival and its effect, s.
  double command_delay = 0;

  /// True if any fault is present.
  bool any() const {
    return ethercat_lost || std::count(silent.begin(), silent.end(), true) > 0 || (encoder_slip != 0).any() ||
           encoder_noise != 0 || command_delay != 0;
  }
};

}  // namespace youbot_base_sim
