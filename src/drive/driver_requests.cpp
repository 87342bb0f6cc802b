#include "youbot_base_sim/drive/driver_requests.h"

#include <algorithm>

namespace youbot_base_sim {

namespace {

template <class... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};
template <class... Functions>
Overloaded(Functions...) -> Overloaded<Functions...>;

/// Returns whether the driver was started anew.
bool obey(double t, const DriverRequest& request, BaseDriver& driver) {
  bool reconnected = false;
  std::visit(Overloaded{[&](const DriveCommand& command) { driver.command(t, command); },
                        [&](SwitchOff) { driver.switch_off(); }, [&](SwitchOn) { driver.switch_on(); },
                        [&](Reconnect) { reconnected = driver.reconnect(); },
                        [&](const Faults& faults) { driver.set_faults(t, faults); }},
             request);
  return reconnected;
}

}  // namespace

bool DriverRequests::push(double t, const DriverRequest& request) {
  const double arrival = waiting_.empty() ? t : std::max(t, waiting_.back().arrival);
  if (merge(arrival, request)) return true;
  if (!std::holds_alternative<DriveCommand>(request) && others() >= kMaxWaiting) return false;
  waiting_.push_back({arrival, request});
  return true;
}

/// Requests that wait and are no commands.
std::size_t DriverRequests::others() const {
  const auto is_other = [](const Stamped& one) { return !std::holds_alternative<DriveCommand>(one.request); };
  return static_cast<std::size_t>(std::count_if(waiting_.begin(), waiting_.end(), is_other));
}

/// Adds a command to the one that arrived before it; false if they do not act from the same control period.
bool DriverRequests::merge(double arrival, const DriverRequest& request) {
  if (waiting_.empty() || time_.first_from(waiting_.back().arrival) != time_.first_from(arrival)) return false;
  auto* last = std::get_if<DriveCommand>(&waiting_.back().request);
  const auto* command = std::get_if<DriveCommand>(&request);
  if (!last || !command) return false;
  waiting_.back().arrival = arrival;
  for (int i = 0; i < kWheels; ++i) {
    if ((*command)[i]) (*last)[i] = (*command)[i];
  }
  return true;
}

bool DriverRequests::take(double t, BaseDriver& driver) {
  bool reconnected = false;
  for (; !waiting_.empty() && ControlTime::reached(waiting_.front().arrival, t); waiting_.pop_front()) {
    reconnected = obey(waiting_.front().arrival, waiting_.front().request, driver) || reconnected;
  }
  return reconnected;
}

bool DriverRequests::present(double t, const BaseDriver& driver) const {
  EthercatConnection connection = driver.connection();
  for (const auto& [arrival, request] : waiting_) {
    if (const auto* faults = std::get_if<Faults>(&request)) connection.set_lost(arrival, faults->ethercat_lost);
    if (std::holds_alternative<Reconnect>(request)) connection.reconnect();
  }
  return connection.update(t);
}

void DriverRequests::bring_forward(double t) {
  for (Stamped& waiting : waiting_) waiting.arrival = std::min(waiting.arrival, t);
}

}  // namespace youbot_base_sim
