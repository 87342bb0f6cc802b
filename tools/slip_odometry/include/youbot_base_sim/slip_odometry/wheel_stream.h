#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/state.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Readings of a base's wheels, of messages as they come, by the rules by which `analyse` reads a bag.
class WheelStream {
 public:
  std::array<std::string, kWheels> joints;
  Wheels rad_per_unit = Wheels::Ones();  ///< of positions; positive forward
  double max_rate = 30;                  ///< rad/s: no wheel is faster
  std::string publisher;                 ///< the node whose messages count; empty: the first, while it publishes

  struct Reading {
    Wheels phi;     ///< rad; positions that begin anew after a turn or a number of ticks are counted on
    Wheels dphi;    ///< positive forward, in the unit of the message; NaN: not there
    Wheels torque;  ///< N m, positive forward as positions are; NaN: not there
  };

  /// The reading of a message of node `from` at t (s) with fields of sensor_msgs/JointState. Empty if it lacks the
  /// position of a wheel, or does not count.
  std::optional<Reading> read(const std::string& from, double t, const std::vector<std::string>& names,
                              const std::vector<double>& positions, const std::vector<double>& velocities,
                              const std::vector<double>& efforts);

  /// What the last message has shown for the first time, in one line; empty: nothing.
  const std::string& finding() const { return finding_; }

 private:
  bool counts(const std::string& from, double t);
  void count_on(double t, const Wheels& phi);

  std::string followed_, other_, finding_;  // publishers: that counts, that was named last
  double time_ = 0, period_ = 0;            // s, of the last reading; rad, 0: unknown
  std::optional<Wheels> last_;              // positions as read, rad
  Wheels min_ = Wheels::Zero(), max_ = Wheels::Zero(), counted_ = Wheels::Zero();  // of them; added to them
  Wheels change_ = Wheels::Zero();                                                 // of the last reading, rad
};

}  // namespace youbot_base_sim
