#include "youbot_base_sim/loop/base_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace youbot_base_sim {

BaseLoop::BaseLoop(const LoopSettings& settings)
    : sensor_options_(settings.sensors),
      control_time_(settings.scene.solver.control_period),
      driver_settings_{control_time_.period(), settings.driver.motor, settings.driver.motors,
                       settings.driver.command_timeout},
      takes_always_(settings.command_rate == 0),
      requests_(control_time_),
      driver_(driver_settings_),
      simulation_(settings.scene),
      sensors_(settings.scene, settings.sensors, driver_.motor(), driver_settings_.quantized()),
      instants_(settings.publish_rate),
      listening_(takes_always_ ? 1 : settings.command_rate) {
  simulation_.continue_when_tipping();  // the node does not end for it; diagnostics report it
}

void BaseLoop::advance_periods(std::int64_t n) {
  const State& state = simulation_.state();
  for (; n > 0; --n) {
    meet_instant();
    const bool listens = takes_always_ || listening_.meet(time());
    if (!requests_.empty()) take_requests(listens);
    simulation_.set_torque(driver_.sample(time(), state.dphi()));
    simulation_.step();
  }
}

// Requests of the motion act at any control period, the driver's only if it `listens` now.
void BaseLoop::take_requests(bool listens) {
  requests_.take_motion(time(), [this](const auto& request) { apply(request); });
  const State& state = simulation_.state();
  const bool reconnected = listens && requests_.take(time(), driver_);
  if (reconnected) sensors_.restart_odometry(state, driver_.torque(), driver_.faults());
}

std::string BaseLoop::refusal(const std::vector<Load>& loads) const {
  const std::string lifted = lifted_wheel(simulation_.scene(), loads, simulation_.time());
  return lifted.empty() ? "" : "loads must be " + lifted;
}

void BaseLoop::apply(const Wrench& wrench) {
  applied_loads_.wrenches = {wrench};
  simulation_.set_loads(applied_loads_);
}

// Loads that are taken off keep their velocity, also where others are added at rest.
void BaseLoop::apply(const LoadsRequest& request) {
  const auto goes = [&](const Load& load) {
    return std::find(request.loads.begin(), request.loads.end(), load) == request.loads.end();
  };
  applied_loads_.loads.erase(std::remove_if(applied_loads_.loads.begin(), applied_loads_.loads.end(), goes),
                             applied_loads_.loads.end());
  simulation_.set_loads(applied_loads_);
  applied_loads_.loads = request.loads;
  simulation_.set_loads(applied_loads_, request.at_rest);
}

void BaseLoop::apply(const StateRequest& request) {
  const State before = simulation_.state();
  simulation_.set_state(request.pose, request.velocity, request.phi);
  sensors_.carry(before, simulation_.state());
}

std::int64_t BaseLoop::periods_until(double t) const {
  return std::max<std::int64_t>(1, control_time_.first_from(t) - periods());
}

bool BaseLoop::meet_instant() {
  if (!instants_.meet(time())) return false;
  sensors_.update(time(), simulation_.state(), driver_.torque(), driver_.faults());
  return true;
}

void BaseLoop::require_finite() const {
  const auto require = [this](const char* topic, const char* what, bool is_finite) {
    if (is_finite) return;
    throw std::runtime_error(fmt::format("{}: the {} is not finite at t = {} s", topic, what, time()));
  };
  const MotorReadings& readings = sensors_.readings();
  const WheelOdometry& odometry = sensors_.odometry();
  require("ground_truth", "state of the base", simulation_.state().values.allFinite());
  require("base/joint_states", "position of a wheel", readings.phi.allFinite());
  require("base/joint_states", "velocity of a wheel", readings.dphi.allFinite());
  require("base/joint_states", "effort of a wheel", readings.torque.allFinite());
  require("odom", "pose", odometry.pose().allFinite());
  require("odom", "twist", odometry.kinematics().velocity(readings.dphi).allFinite());
  if (!odometry.has_covariance()) return;
  require("odom", "pose's covariance", odometry.pose_covariance().allFinite());
  require("odom", "twist's covariance", odometry.velocity_covariance(readings.dphi).allFinite());
}

void BaseLoop::reset() {
  requests_.clear();
  applied_loads_ = {};
  simulation_.reset();
  driver_ = BaseDriver(driver_settings_);
  sensors_ = BaseSensors(simulation_.scene(), sensor_options_, driver_.motor(), driver_settings_.quantized());
  instants_.reset();
  listening_.reset();
}

}  // namespace youbot_base_sim
