#include "youbot_base_sim/drive/base_driver.h"

namespace youbot_base_sim {

constexpr SetPoint kHoldAtRest{DriveMode::kVelocity, 0};

BaseDriver::BaseDriver(const Settings& settings)
    : settings_(settings),
      motor_(settings.motors.limit(settings.motor)),
      drive_(settings.control_period, motor_, settings.motors.gains, settings.quantized()),
      last_command_(kInfinity) {
  send_to_all(kHoldAtRest);
  silent_since_.fill(kInfinity);
}

void BaseDriver::command(double t, const DriveCommand& command) {
  if (!present()) return;
  last_command_ = t;
  timed_out_ = false;
  pending_.push_back({t + settings_.motors.command_delay + faults_.command_delay, command});
}

bool BaseDriver::switch_off() {
  if (!present()) return false;
  pending_.clear();
  last_command_ = kInfinity;
  send_to_all({});
  motors_on_ = false;
  return true;
}

bool BaseDriver::switch_on() {
  if (!present()) return false;
  send_to_all(kHoldAtRest);
  motors_on_ = true;
  return true;
}

bool BaseDriver::reconnect() {
  connection_.reconnect();
  pending_.clear();
  last_command_ = kInfinity;
  timed_out_ = false;
  switch_on();
  return present();
}

void BaseDriver::set_faults(double t, const Faults& faults) {
  faults_ = faults;
  connection_.set_lost(t, faults.ethercat_lost);
  for (int i = 0; i < kWheels; ++i) silent_since_[i] = responds(i) ? kInfinity : std::min(silent_since_[i], t);
}

const Wheels& BaseDriver::sample(double t, const Wheels& dphi) {
  apply_due_commands(t);
  check_command_timeout(t);
  exchange_ethercat(t);
  return torque_ = drive_.sample(dphi);
}

void BaseDriver::apply_due_commands(double t) {
  while (!pending_.empty() && ControlTime::reached(pending_.front().due, t)) {
    for (int i = 0; i < kWheels; ++i) {
      if (const auto& set_point = pending_.front().command[i]) sent_[i] = *set_point;
    }
    pending_.pop_front();
  }
}

void BaseDriver::check_command_timeout(double t) {
  if (settings_.command_timeout == 0 || timed_out_) return;
  if (!ControlTime::reached(last_command_ + settings_.command_timeout, t)) return;
  timed_out_ = events_.timed_out = true;
  pending_.clear();
  send_to_all(kHoldAtRest);
}

void BaseDriver::exchange_ethercat(double t) {
  for (int i = 0; i < kWheels; ++i) {
    if (responds(i)) {
      drive_.command(i, sent_[i]);
    } else if (ControlTime::reached(silent_since_[i] + EthercatConnection::kTimeout, t)) {
      drive_.command(i, {});
    }
  }
  const bool was_present = present();
  if (!connection_.update(t)) {
    events_.base_lost = events_.base_lost || was_present;
    motors_on_ = false;
    // No earlier command moves the base when the cable is in again.
    pending_.clear();
    send_to_all({});
  }
}

}  // namespace youbot_base_sim
