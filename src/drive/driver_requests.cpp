#include "youbot_base_sim/drive/driver_requests.h"

#include <algorithm>

namespace youbot_base_sim {

namespace {

constexpr double kSlack = 1e-9;  // s, for times that are sums of control periods

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

void DriverRequests::push(double t, const DriverRequest& request) {
  waiting_.push_back({waiting_.empty() ? t : std::max(t, waiting_.back().arrival), request});
}

bool DriverRequests::take(double t, BaseDriver& driver) {
  bool reconnected = false;
  for (; !waiting_.empty() && waiting_.front().arrival <= t + kSlack; waiting_.pop_front()) {
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
