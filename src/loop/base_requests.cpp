#include "youbot_base_sim/loop/base_requests.h"

#include <algorithm>

namespace youbot_base_sim {

namespace {

bool is_command(const BaseRequest& request) { return std::holds_alternative<DriveCommand>(request); }

bool is_of_motion(const BaseRequest& request) {
  return std::holds_alternative<Wrench>(request) || std::holds_alternative<LoadsRequest>(request) ||
         std::holds_alternative<StateRequest>(request);
}

/// Adds `request` to `last`, which acts from the same control period; false if they do not make one.
bool add(const BaseRequest& request, BaseRequest& last) {
  if (request.index() != last.index()) return false;
  if (!is_command(request)) {
    if (std::holds_alternative<Wrench>(request)) last = request;
    return std::holds_alternative<Wrench>(request);
  }
  const auto& command = std::get<DriveCommand>(request);
  for (int i = 0; i < kWheels; ++i) {
    if (command[i]) std::get<DriveCommand>(last)[i] = command[i];
  }
  return true;
}

}  // namespace

bool BaseRequests::push(double t, const BaseRequest& request) {
  for (const auto* queue : {&driver_, &motion_}) {
    if (!queue->empty()) t = std::max(t, queue->back().arrival);
  }
  std::deque<Stamped>& queue = is_of_motion(request) ? motion_ : driver_;
  const bool same_period = !queue.empty() && time_.first_from(queue.back().arrival) == time_.first_from(t);
  if (same_period && add(request, queue.back().request)) {
    queue.back().arrival = t;
    return true;
  }
  const auto is_other = [](const Stamped& one) { return !is_command(one.request); };
  const auto of_driver = static_cast<std::size_t>(std::count_if(driver_.begin(), driver_.end(), is_other));
  if (!is_command(request) && of_driver + motion_.size() >= kMaxWaiting) return false;
  queue.emplace_back(t, request);
  return true;
}

bool BaseRequests::take(double t, BaseDriver& driver) {
  bool reconnected = false;
  for (; is_due(driver_, t); driver_.pop_front()) {
    const auto& [arrival, request] = driver_.front();
    if (const auto* command = std::get_if<DriveCommand>(&request)) driver.command(arrival, *command);
    if (std::holds_alternative<SwitchOff>(request)) driver.switch_off();
    if (std::holds_alternative<SwitchOn>(request)) driver.switch_on();
    if (std::holds_alternative<Reconnect>(request)) reconnected = driver.reconnect() || reconnected;
    if (const auto* faults = std::get_if<Faults>(&request)) driver.set_faults(arrival, *faults);
  }
  return reconnected;
}

bool BaseRequests::present(double t, const BaseDriver& driver) const {
  EthercatConnection connection = driver.connection();
  for (const auto& [arrival, request] : driver_) {
    if (const auto* faults = std::get_if<Faults>(&request)) connection.set_lost(arrival, faults->ethercat_lost);
    if (std::holds_alternative<Reconnect>(request)) connection.reconnect();
  }
  return connection.update(t);
}

void BaseRequests::bring_forward(double t) {
  for (auto* queue : {&driver_, &motion_}) {
    for (Stamped& waiting : *queue) waiting.arrival = std::min(waiting.arrival, t);
  }
}

}  // namespace youbot_base_sim
