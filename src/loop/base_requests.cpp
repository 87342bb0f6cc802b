#include "youbot_base_sim/loop/base_requests.h"

#include <algorithm>

namespace youbot_base_sim {

namespace {

template <class... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};
template <class... Functions>
Overloaded(Functions...) -> Overloaded<Functions...>;

bool is_command(const BaseRequest& request) { return std::holds_alternative<DriveCommand>(request); }

bool is_of_loads(const BaseRequest& request) {
  return std::holds_alternative<Wrench>(request) || std::holds_alternative<LoadsRequest>(request);
}

/// Makes a request that arrived at time t (s). False if it is not the driver's.
bool apply(double t, const BaseRequest& request, BaseDriver& driver, bool& reconnected) {
  return std::visit(Overloaded{[&](const DriveCommand& command) { return driver.command(t, command), true; },
                               [&](SwitchOff) { return driver.switch_off(), true; },
                               [&](SwitchOn) { return driver.switch_on(), true; },
                               [&](Reconnect) { return reconnected = driver.reconnect() || reconnected, true; },
                               [&](const Faults& faults) { return driver.set_faults(t, faults), true; },
                               [](const auto&) { return false; }},
                    request);
}

/// Adds `request` to `last`, which acts from the same control period; false if they do not make one.
bool add(const BaseRequest& request, BaseRequest& last) {
  if (std::holds_alternative<Wrench>(request) && std::holds_alternative<Wrench>(last)) return last = request, true;
  auto* before = std::get_if<DriveCommand>(&last);
  const auto* command = std::get_if<DriveCommand>(&request);
  if (!before || !command) return false;
  for (int i = 0; i < kWheels; ++i) {
    if ((*command)[i]) (*before)[i] = (*command)[i];
  }
  return true;
}

}  // namespace

bool BaseRequests::push(double t, const BaseRequest& request) {
  const double arrival = waiting_.empty() ? t : std::max(t, waiting_.back().arrival);
  if (merge(arrival, request)) return true;
  if (!is_command(request) && others() >= kMaxWaiting) return false;
  waiting_.emplace_back(arrival, request);
  return true;
}

/// Requests that wait and are no commands.
std::size_t BaseRequests::others() const {
  const auto is_other = [](const Stamped& one) { return !is_command(one.request); };
  return static_cast<std::size_t>(std::count_if(waiting_.begin(), waiting_.end(), is_other));
}

/// Adds a request to the last one of the driver's, or of the loads', that acts from the same control period; false if
/// there is none to add it to.
bool BaseRequests::merge(double arrival, const BaseRequest& request) {
  const std::int64_t period = time_.first_from(arrival);
  for (auto one = waiting_.rbegin(); one != waiting_.rend() && time_.first_from(one->arrival) == period; ++one) {
    if (is_of_loads(one->request) != is_of_loads(request)) continue;
    if (!add(request, one->request)) return false;
    one->arrival = arrival;
    return true;
  }
  return false;
}

bool BaseRequests::take(double t, BaseDriver& driver) {
  bool reconnected = false;
  take_due(t, [&](const Stamped& one) { return apply(one.arrival, one.request, driver, reconnected); });
  return reconnected;
}

std::int64_t BaseRequests::period_of_loads() const {
  for (const Stamped& one : waiting_) {
    if (is_of_loads(one.request)) return time_.first_from(one.arrival);
  }
  return std::numeric_limits<std::int64_t>::max();
}

bool BaseRequests::present(double t, const BaseDriver& driver) const {
  EthercatConnection connection = driver.connection();
  for (const auto& [arrival, request] : waiting_) {
    if (const auto* faults = std::get_if<Faults>(&request)) connection.set_lost(arrival, faults->ethercat_lost);
    if (std::holds_alternative<Reconnect>(request)) connection.reconnect();
  }
  return connection.update(t);
}

void BaseRequests::bring_forward(double t) {
  for (Stamped& waiting : waiting_) waiting.arrival = std::min(waiting.arrival, t);
}

}  // namespace youbot_base_sim
