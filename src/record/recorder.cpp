#include "youbot_base_sim/record/recorder.h"

#include <fmt/format.h>

#include <iterator>
#include <utility>

namespace youbot_base_sim {

namespace {

/// Makes lines of CSV of a row.
using LinesOf = std::string (*)(double t, const Simulation& simulation, const Events& events);

class Csv : public Recorder {
 public:
  Csv(OutputFile file, std::string header, LinesOf lines_of)
      : file_(std::move(file)), header_(std::move(header)), lines_of_(lines_of) {}

  void write(double t, const Simulation& simulation, const Events& events) override {
    const std::string lines = std::exchange(header_, "") + lines_of_(t, simulation, events);
    if (!lines.empty()) file_.write(lines);
  }
  void commit() override { file_.commit(); }
  std::string keep_incomplete() override { return file_.keep_incomplete(); }

 private:
  OutputFile file_;
  std::string header_;  // empty once it is written, with the first row
  LinesOf lines_of_;
};

// {} writes the fewest digits that read back as the same number.
std::string state_line(double t, const Simulation& simulation, const Events&) {
  std::string line = fmt::format("{}", t);
  for (int column = 0; column < 5; ++column) {
    for (int k = 0; k < (column < 2 ? 3 : kWheels); ++k)
      fmt::format_to(std::back_inserter(line), ",{}", simulation.state().values(k, column));
  }
  return line + "\n";
}

std::string switch_lines(double, const Simulation&, const Events& events) {
  std::string lines;
  for (const RollerSwitch& event : events.switches) {
    lines += fmt::format("{},{},{},{},{},{},{}\n", event.t, kWheelNames[static_cast<std::size_t>(event.wheel)],
                         event.roller_from, event.roller_to, event.phi, event.direction, event.count);
  }
  return lines;
}

}  // namespace

std::unique_ptr<Recorder> state_csv(OutputFile file, const std::string& comment) {
  std::string header = comment + "t,x,y,psi,V_X,V_Y,Omega";
  for (const char* quantity : {"phi", "dphi", "dgamma"}) {
    for (const char* wheel : kWheelNames) header += fmt::format(",{}_{}", quantity, wheel);
  }
  return std::make_unique<Csv>(std::move(file), header + "\n", &state_line);
}

std::unique_ptr<Recorder> switch_csv(OutputFile file, const std::string& comment) {
  return std::make_unique<Csv>(std::move(file), comment + "t,wheel,roller_from,roller_to,phi,direction,count\n",
                               &switch_lines);
}

}  // namespace youbot_base_sim
