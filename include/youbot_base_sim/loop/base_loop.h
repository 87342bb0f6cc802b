#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "youbot_base_sim/drive/base_driver.h"
#include "youbot_base_sim/drive/control_time.h"
#include "youbot_base_sim/loop/base_requests.h"
#include "youbot_base_sim/loop/base_sensors.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// Scene, driver, sensors and rates of a BaseLoop.
struct LoopSettings {
  Scene scene;               ///< with a control period; its `drive` section is ignored
  double publish_rate = 50;  ///< of reading the motors and updating odometry, Hz
  /// Rate at which the driver takes requests, Hz. 0: each acts from the first control period after its arrival.
  double command_rate = 0;
  BaseDriver::Settings driver;  ///< BaseLoop fills in what the scene has: the control period
  BaseSensors::Options sensors;
};

/// The control loop of the simulated base, without ROS: requests go in; state, driver and sensors come out.
///
/// At the beginning t of a control period, in this order: at an instant of publishing the motors are read and odometry
/// is updated; wrenches, loads and states that have arrived by t act; the driver takes its requests likewise and sets
/// the torques. Results depend neither on how periods are grouped into calls nor on whether sensors are read.
class BaseLoop {
 public:
  explicit BaseLoop(const LoopSettings& settings);
  BaseLoop(const BaseLoop&) = delete;
  BaseLoop& operator=(const BaseLoop&) = delete;

  /// Enqueues a request that arrives at simulated time t, s. False if too many wait.
  bool push(double t, const BaseRequest& request) { return requests_.push(t, request); }

  /// The reason why the base cannot carry these besides the scene's loads; empty if it can.
  std::string refusal(const std::vector<Load>& loads) const;

  /// Requests that wait for the control period that takes them.
  std::size_t waiting() const { return requests_.size(); }

  /// True if the driver will have its base for a request that arrives at simulated time t, s.
  bool present(double t) const { return requests_.present(t, driver_); }

  /// Makes requests with later stamps due now, after simulated time was set back against the wall clock.
  void bring_requests_forward() { requests_.bring_forward(time()); }

  /// Advances by n control periods. The motion does not depend on how they are grouped into calls.
  void advance_periods(std::int64_t n);

  /// Has `advance_periods` throw Stopped once `stop` is set; see Simulation.
  void stop_on(const std::atomic<bool>& stop) { simulation_.stop_on(stop); }

  /// Control periods until one ends at time t (s) or later; at least 1.
  std::int64_t periods_until(double t) const;

  /// Time of the next instant of publishing, s.
  double next_instant() const { return instants_.next(); }

  /// True if an instant of publishing is due now. If so, updates the sensors and proceeds to the next instant.
  bool meet_instant();

  /// Throws std::runtime_error, with topic, quantity and time, unless state, odometry and readings are finite.
  void require_finite() const;

  /// Back to t = 0, with a new driver and an empty queue.
  void reset();

  /// Events of the driver since the last `take_driver_events`.
  BaseDriver::Events take_driver_events() { return driver_.take_events(); }

  /// Events of the base since the last `take_events`.
  Events take_events() { return simulation_.take_events(); }

  double time() const { return simulation_.time(); }                       ///< s
  std::int64_t periods() const { return control_time_.ended_by(time()); }  ///< passed so far
  double control_period() const { return control_time_.period(); }         ///< s
  const Simulation& simulation() const { return simulation_; }
  const BaseDriver& driver() const { return driver_; }
  const BaseSensors& sensors() const { return sensors_; }

 private:
  void apply(const Wrench& wrench);
  void apply(const LoadsRequest& request);
  void apply(const StateRequest& request);
  [[gnu::noinline]] void take_requests(bool listens);

  const BaseSensors::Options sensor_options_;
  const ControlTime control_time_;
  const BaseDriver::Settings driver_settings_;
  const bool takes_always_;  // requests, where any control period begins
  BaseRequests requests_;
  AppliedLoads applied_loads_;  // besides the scene's
  BaseDriver driver_;
  Simulation simulation_;
  BaseSensors sensors_;
  Instants instants_, listening_;
};

}  // namespace youbot_base_sim
