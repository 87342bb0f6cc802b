#include "youbot_base_sim/ros/base_loop.h"

#include <algorithm>

namespace youbot_base_sim {

namespace {

BaseDriver::Settings driver_settings(const BaseSettings& settings) {
  BaseDriver::Settings driver = settings.driver;
  driver.control_period = settings.scene.solver.control_period;
  driver.wheel_inertia = settings.scene.robot.J_1;
  return driver;
}

}  // namespace

BaseLoop::BaseLoop(const BaseSettings& settings)
    : driver_settings_(driver_settings(settings)),
      telemetry_options_(settings.telemetry),
      control_time_(settings.scene.solver.control_period),
      takes_always_(settings.command_rate == 0 || settings.lockstep.on),
      requests_(control_time_),
      driver_(driver_settings_, settings.scene.initial.phi()),
      simulation_(settings.scene, [this](double t, const State& state) { return begin_period(t, state); }),
      telemetry_(settings.scene, driver_.read(settings.scene.initial.phi(), settings.scene.initial.dphi()).phi,
                 settings.telemetry),
      instants_(settings.publish_rate),
      listening_(takes_always_ ? 1 : settings.command_rate) {
  simulation_.go_on_tipping();  // a node does not end for it: diagnostics tell
}

Wheels BaseLoop::begin_period(double t, const State& state) {
  if (instants_.due(t)) meet_instant(t, state);
  if (takes_always_ ? !requests_.empty() : listening_.meet(t)) take_requests(t, state);
  return driver_.sample(t, state.dphi());
}

void BaseLoop::take_requests(double t, const State& state) {
  const bool reconnected = requests_.take(t, driver_);
  if (reconnected) telemetry_.restart_odometry(driver_.read(state.phi(), state.dphi()).phi);
}

std::string BaseLoop::refusal(const std::vector<Load>& loads) const {
  const std::string lifted = lifted_wheel(simulation_.scene(), loads, simulation_.time());
  return lifted.empty() ? "" : "loads must be " + lifted;
}

bool BaseLoop::push(const BurdenRequest& request) {
  // Wrenches that act from the same control period become one, in which the last counts.
  if (request.wrench && !burden_requests_.empty()) {
    BurdenRequest& last = burden_requests_.back();
    if (last.wrench && control_time_.first_from(last.arrival) == control_time_.first_from(request.arrival)) {
      last = request;
      return true;
    }
  }
  if (burden_requests_.size() >= DriverRequests::kMaxWaiting) return false;
  burden_requests_.push_back(request);
  return true;
}

void BaseLoop::bring_requests_forward() {
  requests_.bring_forward(simulation_.time());
  for (BurdenRequest& request : burden_requests_) request.arrival = std::min(request.arrival, simulation_.time());
}

// What is taken off goes with the velocity that it has, also where others are put on at rest.
void BaseLoop::take_off(const std::vector<Load>& remaining) {
  const auto goes = [&](const Load& load) {
    return std::find(remaining.begin(), remaining.end(), load) == remaining.end();
  };
  burden_.loads.erase(std::remove_if(burden_.loads.begin(), burden_.loads.end(), goes), burden_.loads.end());
  simulation_.set_burden(burden_);
}

void BaseLoop::take_burdens() {
  for (; !burden_requests_.empty() && ControlTime::reached(burden_requests_.front().arrival, time());
       burden_requests_.pop_front()) {
    const BurdenRequest& request = burden_requests_.front();
    if (request.wrench) burden_.wrenches = {*request.wrench};
    if (request.loads) {
      take_off(*request.loads);
      burden_.loads = *request.loads;
    }
    simulation_.set_burden(burden_, request.at_rest);
  }
}

// In parts where loads or wrenches change: not while odeint's loop goes through the periods.
void BaseLoop::advance_periods(std::int64_t n) {
  while (n > 0) {
    if (!burden_requests_.empty()) take_burdens();
    std::int64_t part = n;
    if (!burden_requests_.empty()) {
      part = std::clamp<std::int64_t>(control_time_.first_from(burden_requests_.front().arrival) - periods(), 1, n);
    }
    simulation_.advance_periods(part);
    n -= part;
  }
}

std::int64_t BaseLoop::periods_until(double t) const {
  return std::max<std::int64_t>(1, control_time_.first_from(t) - periods());
}

bool BaseLoop::meet_instant(double t, const State& state) {
  if (!instants_.meet(t)) return false;
  telemetry_.update(t, state, driver_.read(state.phi(), state.dphi()).phi);
  return true;
}

void BaseLoop::reset() {
  requests_.clear();
  burden_requests_.clear();
  burden_ = {};
  simulation_.reset();
  const State& state = simulation_.state();
  driver_ = BaseDriver(driver_settings_, state.phi());
  telemetry_ = Telemetry(simulation_.scene(), driver_.read(state.phi(), state.dphi()).phi, telemetry_options_);
  instants_.reset();
  listening_.reset();
}

}  // namespace youbot_base_sim
