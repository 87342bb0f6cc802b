#pragma once

#include <array>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// What may go wrong between a stack and the wheels; nothing by default.
struct Faults {
  /// The EtherCAT cable is out. The driver notices after 100 cycles of 1 ms and gives the base up; the motors' own
  /// time-out lets the wheels turn freely by then. Once the cable is in again, the driver must be told to reconnect.
  bool ethercat_lost = false;
  /// Motors that do not answer: their readings stand still, set points do not reach them, and after their time-out they
  /// are off. The driver goes on.
  std::array<bool, kWheels> silent{};
  /// Share of a wheel's turning that its encoder misses, 0 .. 1, as if it slipped on its shaft.
  Wheels encoder_slip = Wheels::Zero();
  /// Standard deviation of each reading of an encoder, rad of the wheel.
  double encoder_noise = 0;
  /// Time from a command's arrival to its taking effect, s.
  double command_delay = 0;

  /// Whether there is any.
  bool any() const {
    for (const bool is_silent : silent) {
      if (is_silent) return true;
    }
    return ethercat_lost || (encoder_slip != 0).any() || encoder_noise != 0 || command_delay != 0;
  }
};

}  // namespace youbot_base_sim
