#include "youbot_base_sim/record/summary.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

namespace youbot_base_sim {

namespace {

void add_audit(const Simulation& simulation, const RunAudit& audit, nlohmann::json& json) {
  const RunCost::Period& slowest = audit.cost.slowest();
  json["completed"] = audit.completed;
  json["reliable"] = audit.completed && unreliability_reason(simulation, audit.energy).empty();
  json["cpu_time"] = audit.cost.cpu_time();
  json["slowest_period"] = {{"start", slowest.start},
                            {"length", slowest.length},
                            {"cpu_time", slowest.cpu_time},
                            {"cost", slowest.length > 0 ? slowest.cpu_time / slowest.length : 0}};
  json["periods"] = {{"count", audit.cost.periods()},
                     {"late", audit.cost.late_periods()},
                     {"cpu_time_99_9", audit.cost.percentile(0.999)}};
  json["energy"] = {{"max_balance_error", audit.energy.max_balance_error()},
                    {"max_kinetic", audit.energy.max_kinetic_energy()},
                    {"drive_work", audit.energy.drive_work()}};
  const Wheels& wheels = audit.path.wheels();
  json["path_length"] = {{"base", audit.path.base()}, {"wheels", {wheels[0], wheels[1], wheels[2], wheels[3]}}};
}

}  // namespace

std::string summary_json(const Simulation& simulation, double wall_time, const RunAudit& audit) {
  const State& x = simulation.state();
  const IntegrationStatistics& statistics = simulation.statistics();
  nlohmann::json json;
  json["model"] = name_of(simulation.scene().model);
  json["method"] = simulation.method();
  json["relative_tolerance"] = simulation.scene().solver.relative_tolerance;
  if (std::isfinite(simulation.regularization_speed())) json["transition_speed"] = simulation.regularization_speed();
  json["control_period"] = simulation.scene().solver.control_period;
  json["simulated_time"] = simulation.time();
  json["wall_time"] = wall_time;
  json["real_time_factor"] = simulation.time() / wall_time;
  for (const StatisticsField& field : kStatisticsFields) json[field.name] = statistics.*field.value;
  json["energy_balance_error"] = simulation.energy_balance_error();
  json["final"] = {{"x", x.x()},     {"y", x.y()},     {"psi", x.psi()},
                   {"V_X", x.V_X()}, {"V_Y", x.V_Y()}, {"Omega", x.Omega()}};
  if (const auto record = simulation.reaction_record()) {
    const auto numbers = [](const Wheels& w) { return std::vector<double>(w.data(), w.data() + w.size()); };
    json["normal_reactions"] = {{"least", numbers(record->min_N)}, {"time_off_floor", numbers(record->time_off_floor)}};
  }
  add_audit(simulation, audit, json);
  return json.dump(2) + "\n";
}

std::string summary_text(const Simulation& simulation, double wall_time) {
  const State& x = simulation.state();
  const IntegrationStatistics& statistics = simulation.statistics();
  std::string text = fmt::format(
      "model {} by {}: {:g} s in {:.3g} s, {:.4g} times real time\n"
      "final pose      x {:.6f} m, y {:.6f} m, psi {:.6f} rad\n"
      "final velocity  V_X {:.6f} m/s, V_Y {:.6f} m/s, Omega {:.6f} rad/s\n"
      "energy balance  closes to {:.2g} J\n",
      name_of(simulation.scene().model), simulation.method(), simulation.time(), wall_time,
      simulation.time() / wall_time, x.x(), x.y(), x.psi(), x.V_X(), x.V_Y(), x.Omega(),
      simulation.energy_balance_error());
  for (const StatisticsField& field : kStatisticsFields) {
    if (const std::uint64_t value = statistics.*field.value) text += fmt::format("{:>13}  {}\n", value, field.text);
  }
  const auto rollers = simulation.rollers();
  const auto others = simulation.other_rollers();
  for (int i = 0; i < kWheels; ++i) {
    if (!others[i]) continue;
    text += fmt::format("wheel {} ends between rollers {} and {}\n", kWheelNames[i], rollers[i], *others[i]);
  }
  if (const auto record = simulation.reaction_record()) {
    const Wheels& N = record->min_N;
    text += fmt::format("least normal reactions {:.1f}, {:.1f}, {:.1f}, {:.1f} N", N[0], N[1], N[2], N[3]);
    const Wheels& off = record->time_off_floor;
    if ((off > 0).any())
      text += fmt::format("; off the floor {:.3g}, {:.3g}, {:.3g}, {:.3g} s", off[0], off[1], off[2], off[3]);
    text += "\n";
  }
  if (std::isfinite(simulation.regularization_speed()) &&
      simulation.regularization_speed() > simulation.scene().floor.nu) {
    text += fmt::format(
        "note: friction is regularised over {:g} m/s of slip: at this tolerance {:g} m/s makes no difference\n",
        simulation.regularization_speed(), simulation.scene().floor.nu);
  }
  if (statistics.averaged_contacts > 0) {
    text += fmt::format("note: switches of wheels that pass more than {:g} rollers a second are counted, not located\n",
                        kMaxLocatedRate);
  }
  if (statistics.relaxed_periods > 0) {
    text += fmt::format("note: {} milliseconds were integrated to a looser tolerance to bound the work\n",
                        statistics.relaxed_periods);
  }
  return text;
}

}  // namespace youbot_base_sim
