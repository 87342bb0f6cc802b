#pragma once

#include <deque>
#include <optional>
#include <variant>
#include <vector>

#include "youbot_base_sim/drive/base_driver.h"
#include "youbot_base_sim/drive/control_time.h"
#include "youbot_base_sim/physics/applied_loads.h"

namespace youbot_base_sim {

struct SwitchOff {};  ///< BaseDriver::switch_off
struct SwitchOn {};   ///< BaseDriver::switch_on
struct Reconnect {};  ///< BaseDriver::reconnect

/// Loads besides the scene's, from then on.
struct LoadsRequest {
  std::vector<Load> loads;
  bool at_rest = false;  ///< put on at rest: the base's momentum stays, where otherwise its velocities do
};

/// Puts the base elsewhere, see Simulation::set_state.
struct StateRequest {
  Eigen::Vector3d pose, velocity;
  std::optional<Wheels> phi;
};

/// A request to the driver, or a change of the motion: a push from then on, loads, or another state.
using BaseRequest =
    std::variant<DriveCommand, SwitchOff, SwitchOn, Reconnect, Faults, Wrench, LoadsRequest, StateRequest>;

/// Queue of requests to the control loop, in order of arrival, each stamped with the simulated time of its arrival (s).
/// A request acts from the first control period that begins at its arrival or later.
///
/// The queue is bounded even while time stands still. Successive commands for the same control period become one, in
/// which the last set point of each wheel counts, as in the driver; a simulated delay then counts from the last of
/// them. Of such wrenches the last counts. At most `kMaxWaiting` other requests wait. The driver's requests and those
/// of the motion (wrenches, loads and states) do not wait for each other.
class BaseRequests {
 public:
  static constexpr std::size_t kMaxWaiting = 1000;

  explicit BaseRequests(const ControlTime& time) : time_(time) {}

  /// Appends a request that arrives at time t, but after the last. False if too many wait, which refuses no command.
  bool push(double t, const BaseRequest& request);

  /// Makes the requests of `driver` that have arrived by time t, in order. Returns whether a reconnect has succeeded.
  bool take(double t, BaseDriver& driver);

  /// Calls `apply(request)` for each Wrench, LoadsRequest and StateRequest that has arrived by time t, in order.
  template <class Apply>
  void take_motion(double t, const Apply& apply) {
    for (; is_due(motion_, t); motion_.pop_front()) {
      const BaseRequest& request = motion_.front().request;
      if (const auto* wrench = std::get_if<Wrench>(&request)) apply(*wrench);
      if (const auto* loads = std::get_if<LoadsRequest>(&request)) apply(*loads);
      if (const auto* state = std::get_if<StateRequest>(&request)) apply(*state);
    }
  }

  /// True if `driver` will have its base when it takes a request that arrives at time t, after all that waits here.
  bool present(double t, const BaseDriver& driver) const;

  /// Sets later arrivals to time t, when simulated time is set back against the wall clock.
  void bring_forward(double t);

  void clear() {
    driver_.clear();
    motion_.clear();
  }
  bool empty() const { return driver_.empty() && motion_.empty(); }
  std::size_t size() const { return driver_.size() + motion_.size(); }  ///< requests that wait

 private:
  struct Stamped {
    Stamped(double t, const BaseRequest& made) : arrival(t), request(made) {}  // in place: gcc warns of moved ones
    double arrival;                                                            // s
    BaseRequest request;
  };

  static bool is_due(const std::deque<Stamped>& queue, double t) {
    return !queue.empty() && ControlTime::reached(queue.front().arrival, t);
  }

  ControlTime time_;
  std::deque<Stamped> driver_, motion_;  // those of the driver, and those of the motion
};

}  // namespace youbot_base_sim
