#pragma once

#include <deque>
#include <variant>

#include "youbot_base_sim/drive/base_driver.h"

namespace youbot_base_sim {

struct SwitchOff {};  ///< BaseDriver::switch_off
struct SwitchOn {};   ///< BaseDriver::switch_on
struct Reconnect {};  ///< BaseDriver::reconnect

/// What a stack may ask of the base driver.
using DriverRequest = std::variant<DriveCommand, SwitchOff, SwitchOn, Reconnect, Faults>;

/// Queue of requests from whoever receives them to the control loop, in order of arrival, each stamped with the
/// simulated time of its arrival (s). The receiver only appends; the loop takes what is due where a control period
/// begins. So a request acts from the first control period that begins at its arrival or later, whatever the loop is
/// doing when it comes.
class DriverRequests {
 public:
  /// Appends a request that arrives at time t, or with the one before it if that is later.
  void push(double t, const DriverRequest& request);

  /// Makes `driver` obey, in order, what has arrived by time t. Returns whether a reconnect has succeeded.
  bool take(double t, BaseDriver& driver);

  /// Whether `driver` will have its base when it takes a request that arrives at time t, after all that still waits
  /// here.
  bool present(double t, const BaseDriver& driver) const;

  /// Sets later arrivals to time t, for simulated time that is set back against the wall clock.
  void bring_forward(double t);

  void clear() { waiting_.clear(); }
  bool empty() const { return waiting_.empty(); }

 private:
  struct Stamped {
    double arrival;
    DriverRequest request;
  };

  std::deque<Stamped> waiting_;
};

}  // namespace youbot_base_sim
