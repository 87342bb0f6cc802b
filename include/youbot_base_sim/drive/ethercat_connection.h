#pragma once

#include <algorithm>
#include <limits>

#include "youbot_base_sim/drive/control_time.h"

namespace youbot_base_sim {

/// Whether the driver is connected to its base. It gives the base up when EtherCAT has failed for longer than its
/// time-out, and finds it again only by a reconnect while the cable is in. Times are simulated time, s.
class EthercatConnection {
 public:
  /// EtherCAT's cycle of 1 ms times the driver's MaximumNumberOfEtherCATErrors; also the MotorControllerTimeout of the
  /// motors' firmware, s.
  static constexpr double kTimeout = 0.1;

  /// Whether the base was there at the last `update`.
  bool present() const { return present_; }

  /// Looks at time t whether the base is still there, as the driver does in each of its cycles.
  bool update(double t) { return present_ = present_ && !ControlTime::reached(lost_since_ + kTimeout, t); }

  /// The cable comes out at time t, or is in again.
  void set_lost(double t, bool lost) {
    update(t);
    lost_since_ = lost ? std::min(lost_since_, t) : kNever;
  }

  /// Starts anew. False if the cable is still out: then the base is not there.
  bool reconnect() { return present_ = lost_since_ == kNever; }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  bool present_ = true;
  double lost_since_ = kNever;  // infinite: the cable is in
};

}  // namespace youbot_base_sim
