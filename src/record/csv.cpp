#include "youbot_base_sim/record/csv.h"

#include <fmt/format.h>

#include <utility>

namespace youbot_base_sim {

namespace {
constexpr char kNumber[] = ",{:.17g}";
}

StateCsv::StateCsv(OutputFile file) : file_(std::move(file)), header_("t,x,y,psi,V_X,V_Y,Omega") {
  for (const char* quantity : {"phi", "dphi", "dgamma"}) {
    for (const char* wheel : kWheelNames) header_ += fmt::format(",{}_{}", quantity, wheel);
  }
  header_ += "\n";
}

void StateCsv::write(double t, const Simulation& simulation, const Events&) {
  const State& state = simulation.state();
  std::string row = std::exchange(header_, "") + fmt::format("{:.17g}", t);
  for (int column : {0, 1}) {
    for (int k = 0; k < 3; ++k) row += fmt::format(kNumber, state.values(k, column));
  }
  for (int column : {2, 3, 4}) {
    for (int k = 0; k < kWheels; ++k) row += fmt::format(kNumber, state.values(k, column));
  }
  file_.write(row + "\n");
}

SwitchCsv::SwitchCsv(OutputFile file)
    : file_(std::move(file)), header_("t,wheel,roller_from,roller_to,phi,direction,count\n") {}

void SwitchCsv::write(double, const Simulation&, const Events& events) {
  std::string rows = std::exchange(header_, "");
  for (const RollerSwitch& event : events.switches) {
    rows += fmt::format("{:.17g},{},{},{},{:.17g},{},{}\n", event.t, kWheelNames[static_cast<std::size_t>(event.wheel)],
                        event.roller_from, event.roller_to, event.phi, event.direction, event.count);
  }
  if (!rows.empty()) file_.write(rows);
}

}  // namespace youbot_base_sim
