#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "youbot_base_sim/drive/base_driver.h"
#include "youbot_base_sim/drive/control_time.h"
#include "youbot_base_sim/drive/driver_requests.h"
#include "youbot_base_sim/ros/base_settings.h"
#include "youbot_base_sim/ros/schedule.h"
#include "youbot_base_sim/ros/telemetry.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// The control loop of the simulated base, without ROS around it: driver requests go in, readings and telemetry come
/// out.
///
/// At time t, where a control period begins, three things happen in this order: if an instant of publishing is due, the
/// motors are read and odometry makes its step; the driver takes the requests that have arrived by t; the driver sets
/// the torques of the period. So the results depend neither on how many periods one call advances by nor on whether
/// anybody looks at them.
class BaseLoop {
 public:
  /// Uses the settings' scene, driver, telemetry, `publish_rate`, `command_rate` and `lockstep`.
  explicit BaseLoop(const BaseSettings& settings);
  BaseLoop(const BaseLoop&) = delete;
  BaseLoop& operator=(const BaseLoop&) = delete;

  /// Enqueues a request that arrives at simulated time t, s. False if it is refused because too many wait.
  bool push(double t, const DriverRequest& request) { return requests_.push(t, request); }

  /// Enqueues, for the same time, what pushes the base from then on; what it carries besides the scene's loads, with
  /// its momentum kept if `at_rest`.
  bool push(double t, const Wrench& wrench) { return push({t, wrench, {}, false}); }
  bool push(double t, const std::vector<Load>& loads, bool at_rest) { return push({t, {}, loads, at_rest}); }

  /// Why the base cannot carry these besides the scene's loads, in words; empty if it can.
  std::string refusal(const std::vector<Load>& loads) const;

  /// Requests that wait for the control period that takes them.
  std::size_t waiting() const { return requests_.size(); }

  /// Whether the driver will have its base for a request that arrives at simulated time t, s.
  bool present(double t) const { return requests_.present(t, driver_); }

  /// Makes requests that are stamped later than now due now, after simulated time was set back against the wall clock.
  void bring_requests_forward();

  /// Advances by n control periods. The motion does not depend on how they are grouped into calls.
  void advance_periods(std::int64_t n);

  /// Has `advance_periods` throw Stopped once `stop` is set; see Simulation.
  void stop_on(const std::atomic<bool>& stop) { simulation_.stop_on(stop); }

  /// Control periods until one ends at time t (s) or later; at least 1.
  std::int64_t periods_until(double t) const;

  /// Time of the next instant of publishing, s.
  double next_instant() const { return instants_.next(); }

  /// Whether an instant of publishing is due now. If so, the telemetry is updated, and the next instant is the one
  /// after it.
  bool meet_instant() { return meet_instant(simulation_.time(), simulation_.state()); }

  /// Throws std::runtime_error, with what and when, unless all that telemetry tells at the instant that was met last is
  /// finite.
  void require_finite() const { telemetry_.require_finite(simulation_, driver_.readings()); }

  /// Back to t = 0, with a new driver and an empty queue.
  void reset();

  /// What has happened to the driver since the last `take_events`.
  BaseDriver::Events take_events() { return driver_.take_events(); }

  /// What has happened to the base since the last `take_happenings`.
  Events take_happenings() { return {simulation_.take_switches(), simulation_.take_burden_changes()}; }

  /// `Telemetry::visit` for the present time, which must be the instant that was met last.
  template <class Topic>
  void visit_telemetry(const ros::Time& stamp, Topic&& topic) const {
    telemetry_.visit(simulation_, driver_.readings(), stamp, topic);
  }

  double time() const { return simulation_.time(); }                       ///< s
  std::int64_t periods() const { return control_time_.ended_by(time()); }  ///< that have passed
  double control_period() const { return control_time_.period(); }         ///< s
  const Simulation& simulation() const { return simulation_; }
  const BaseDriver& driver() const { return driver_; }
  const Telemetry& telemetry() const { return telemetry_; }

 private:
  struct BurdenRequest {
    double arrival;
    std::optional<Wrench> wrench;
    std::optional<std::vector<Load>> loads;
    bool at_rest;
  };

  bool push(const BurdenRequest& request);
  void take_burdens();
  void take_off(const std::vector<Load>& remaining);
  Wheels begin_period(double t, const State& state);
  bool meet_instant(double t, const State& state);
  [[gnu::noinline]] void take_requests(double t, const State& state);

  const BaseDriver::Settings driver_settings_;
  const Telemetry::Options telemetry_options_;
  const ControlTime control_time_;
  const bool takes_always_;  // requests, where any control period begins
  DriverRequests requests_;
  std::deque<BurdenRequest> burden_requests_;
  Burden burden_;  // besides the scene's
  BaseDriver driver_;
  Simulation simulation_;
  Telemetry telemetry_;
  Schedule instants_, listening_;
};

}  // namespace youbot_base_sim
