#include "youbot_base_sim/ros/base_loop.h"

#include <algorithm>
#include <cmath>

namespace youbot_base_sim {

namespace {

constexpr double kSlack = 1e-6;  // of a control period, for rounding

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
      takes_always_(settings.command_rate == 0 || settings.lockstep),
      requests_(settings.scene.solver.control_period),
      driver_(driver_settings_, settings.scene.initial.phi()),
      simulation_(settings.scene, [this](double t, const State& state) { return begin_period(t, state); }),
      telemetry_(settings.scene.robot.rollers,
                 driver_.read(settings.scene.initial.phi(), settings.scene.initial.dphi()).phi, settings.telemetry),
      instants_(settings.publish_rate, kSlack * control_period()),
      listening_(takes_always_ ? 1 : settings.command_rate, kSlack * control_period()) {
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

std::int64_t BaseLoop::periods_until(double t) const {
  const double periods = std::ceil((t - simulation_.time()) / control_period() - kSlack);
  return std::max<std::int64_t>(1, static_cast<std::int64_t>(periods));
}

bool BaseLoop::meet_instant(double t, const State& state) {
  if (!instants_.meet(t)) return false;
  telemetry_.update(driver_.read(state.phi(), state.dphi()).phi);
  return true;
}

void BaseLoop::reset() {
  requests_.clear();
  simulation_.reset();
  const State& state = simulation_.state();
  driver_ = BaseDriver(driver_settings_, state.phi());
  telemetry_ =
      Telemetry(simulation_.scene().robot.rollers, driver_.read(state.phi(), state.dphi()).phi, telemetry_options_);
  instants_.reset();
  listening_.reset();
}

}  // namespace youbot_base_sim
