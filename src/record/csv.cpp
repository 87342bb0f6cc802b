#include "youbot_base_sim/record/csv.h"

#include <fmt/format.h>

namespace youbot_base_sim {

namespace {
constexpr char kNumber[] = ",{:.17g}";
}

StateCsv::StateCsv(const std::string& path) : file_(path) {
  std::string header = "t,x,y,psi,V_X,V_Y,Omega";
  for (const char* quantity : {"phi", "dphi", "dgamma"}) {
    for (const char* wheel : kWheelNames) header += fmt::format(",{}_{}", quantity, wheel);
  }
  file_.write(header + "\n");
}

void StateCsv::write(double t, const Simulation& simulation, const std::vector<RollerSwitch>&) {
  const State& state = simulation.state();
  std::string row = fmt::format("{:.17g}", t);
  for (int column : {0, 1}) {
    for (int k = 0; k < 3; ++k) row += fmt::format(kNumber, state.values(k, column));
  }
  for (int column : {2, 3, 4}) {
    for (int k = 0; k < kWheels; ++k) row += fmt::format(kNumber, state.values(k, column));
  }
  file_.write(row + "\n");
}

SwitchCsv::SwitchCsv(const std::string& path) : file_(path) {
  file_.write("t,wheel,roller_from,roller_to,phi,direction,count\n");
}

void SwitchCsv::write(double, const Simulation&, const std::vector<RollerSwitch>& switches) {
  for (const RollerSwitch& event : switches) {
    file_.write(fmt::format("{:.17g},{},{},{},{:.17g},{},{}\n", event.t,
                            kWheelNames[static_cast<std::size_t>(event.wheel)], event.roller_from, event.roller_to,
                            event.phi, event.direction, event.count));
  }
}

}  // namespace youbot_base_sim
