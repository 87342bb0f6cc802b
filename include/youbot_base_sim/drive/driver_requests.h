#pragma once

#include <deque>
#include <variant>

#include "youbot_base_sim/drive/base_driver.h"
#include "youbot_base_sim/drive/control_time.h"

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
///
/// The queue is bounded even while time stands still. Commands that follow one another and act from the same control
/// period become one, in which the last set point of each wheel counts, as it would in the driver; a simulated delay
/// then counts from the last of them. Of other requests at most `kMaxWaiting` wait.
class DriverRequests {
 public:
  static constexpr std::size_t kMaxWaiting = 1000;

  explicit DriverRequests(const ControlTime& time) : time_(time) {}

  /// Appends a request that arrives at time t, or with the one before it if that is later. False if it is refused
  /// because too many wait; a command never is.
  bool push(double t, const DriverRequest& request);

  /// Makes `driver` obey, in order, what has arrived by time t. Returns whether a reconnect has succeeded.
  bool take(double t, BaseDriver& driver);

  /// Whether `driver` will have its base when it takes a request that arrives at time t, after all that still waits
  /// here.
  bool present(double t, const BaseDriver& driver) const;

  /// Sets later arrivals to time t, for simulated time that is set back against the wall clock.
  void bring_forward(double t);

  void clear() { waiting_.clear(); }
  bool empty() const { return waiting_.empty(); }
  std::size_t size() const { return waiting_.size(); }  ///< requests that wait

 private:
  struct Stamped {
    double arrival;
    DriverRequest request;
  };

  std::size_t others() const;
  bool merge(double arrival, const DriverRequest& request);

  ControlTime time_;
  std::deque<Stamped> waiting_;
};

}  // namespace youbot_base_sim
