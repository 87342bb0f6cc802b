#include "youbot_base_sim/offline/summary.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "youbot_base_sim/text/version.h"

namespace youbot_base_sim {

namespace {

// Processor time of this thread rather than wall time, so that other programs do not count.
double thread_cpu_time() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

std::vector<double> numbers(const Wheels& w) { return {w.data(), w.data() + w.size()}; }

/// "fl 57.23, fr 96.41, ..."
std::string named(const Wheels& w) {
  std::string text;
  for (int i = 0; i < kWheels; ++i) text += fmt::format("{}{} {:.4g}", i > 0 ? ", " : "", kWheelNames[i], w[i]);
  return text;
}

}  // namespace

void RunCost::start(double t) {
  t_ = t;
  clock_ = thread_cpu_time();
}

void RunCost::stop(double t) {
  const double taken = thread_cpu_time() - clock_;
  cpu_time_ += taken;
  cpu_times_.push_back(static_cast<float>(taken));
  if (taken > t - t_) ++late_;
  if (taken <= slowest_) return;
  start_ = t_;
  length_ = t - t_;
  slowest_ = taken;
}

void RunCost::write_to(nlohmann::json& summary) const {
  std::vector<float> sorted = cpu_times_;
  const auto rank = static_cast<std::ptrdiff_t>(0.999 * (static_cast<double>(sorted.size()) - 1));
  if (!sorted.empty()) std::nth_element(sorted.begin(), sorted.begin() + rank, sorted.end());
  summary["cpu_time"] = cpu_time_;
  summary["slowest_period"] = {
      {"start", start_}, {"length", length_}, {"cpu_time", slowest_}, {"cost", length_ > 0 ? slowest_ / length_ : 0}};
  summary["periods"] = {{"count", sorted.size()},
                        {"late", late_},
                        {"cpu_time_99_9", sorted.empty() ? 0 : static_cast<double>(sorted[rank])}};
}

std::string summary_json(const Simulation& simulation, bool completed, double wall_time, const RunCost& cost,
                         const RowLoop& rows, const Twin* twin) {
  const State& x = simulation.state();
  const IntegrationStatistics& statistics = simulation.statistics();
  nlohmann::json json;
  json["version"] = version();
  json["scene"] = id_of(simulation.scene());
  json["model"] = name_of(simulation.scene().model);
  json["method"] = simulation.method();
  json["relative_tolerance"] = simulation.scene().solver.relative_tolerance;
  if (std::isfinite(simulation.regularization_speed()))
    json["regularization_speed"] = simulation.regularization_speed();
  json["control_period"] = simulation.scene().solver.control_period;
  json["simulated_time"] = simulation.time();
  json["wall_time"] = wall_time;
  json["real_time_factor"] = simulation.time() / wall_time;
  for (const StatisticsField& field : kStatisticsFields) json[field.name] = statistics.*field.value;
  json["energy_balance_error"] = simulation.energy_balance_error();
  json["final"] = {{"x", x.x()},     {"y", x.y()},     {"psi", x.psi()},
                   {"V_X", x.V_X()}, {"V_Y", x.V_Y()}, {"Omega", x.Omega()}};
  if (const auto record = simulation.reaction_record()) {
    json["normal_reactions"] = {{"least", numbers(record->min_N)}, {"time_off_floor", numbers(record->time_off_floor)}};
  }
  json["completed"] = completed;
  json["promised"] = promised_error(simulation, rows.path());
  json["reliable"] = completed && unreliability_reason(simulation, rows, twin).empty();
  if (twin) {
    json["check"] = {{"position_difference", twin->position_difference()},
                     {"heading_difference", twin->heading_difference()},
                     {"promised", promised_error(simulation, rows.path())}};
  }
  cost.write_to(json);
  json["energy"] = {{"max_balance_error", rows.energy().max_balance_error},
                    {"max_kinetic", rows.energy().max_kinetic_energy},
                    {"drive_work", rows.energy().drive_work}};
  json["path_length"] = {{"base", rows.path().base}, {"wheels", numbers(rows.path().wheels)}};
  return json.dump(2) + "\n";
}

std::string summary_text(const Simulation& simulation, double wall_time, const RowLoop& rows, const Twin* twin,
                         bool verbose) {
  const State& x = simulation.state();
  const IntegrationStatistics& statistics = simulation.statistics();
  const auto fix = [](double value, double per = 1e6) { return std::round(per * value) / per + 0.0; };  // no -0
  std::string text = fmt::format(
      "final pose      x {:.6f} m, y {:.6f} m, psi {:.6f} rad ({:.1f} degrees)\n"
      "final velocity  V_X {:.6f} m/s, V_Y {:.6f} m/s, Omega {:.6f} rad/s\n"
      "path            {:.4g} m of the base; a turn counts at the wheels' centres\n"
      "energy balance  closes to {:.2g} J of {:.4g} J that drives and wheels exchanged\n"
      "model {} by {}: {:g} s in {:.3g} s, {:.4g} times real time\n",
      fix(x.x()), fix(x.y()), fix(x.psi()), fix(x.psi() * 180 / M_PI, 10), fix(x.V_X()), fix(x.V_Y()), fix(x.Omega()),
      rows.path().base, simulation.energy_balance_error(), rows.energy().drive_work, name_of(simulation.scene().model),
      simulation.method(), simulation.time(), wall_time, simulation.time() / wall_time);
  if (twin) {
    text += fmt::format("error bar       {:.2g} m, {:.2g} rad: how far a twin at half the tolerance parts from it\n",
                        twin->position_difference(), twin->heading_difference());
  }
  for (const StatisticsField& field : kStatisticsFields) {
    const std::uint64_t value = statistics.*field.value;
    if (verbose && value > 0) text += fmt::format("{:>13}  {}\n", value, field.text);
  }
  const auto rollers = simulation.rollers();
  const auto others = simulation.other_rollers();
  for (int i = 0; i < kWheels; ++i)
    if (others[i])
      text += fmt::format("wheel {} ends between rollers {} and {}\n", kWheelNames[i], rollers[i], *others[i]);
  if (const auto record = simulation.reaction_record()) {
    const Wheels& off = record->time_off_floor;
    text += fmt::format("minimum normal reactions, N: {}", named(record->min_N));
    if ((off > 0).any()) text += fmt::format("; off the floor, s: {}", named(off));
    text += "\n";
  }
  if (simulation.scene().robot.dry_friction.isZero())
    text += "note: drive trains without the dry friction of real bases: see robot.profile\n";
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
  if (statistics.eased_periods > 0) {
    text += fmt::format("note: in {} milliseconds wheels that chatter were held early to bound the work\n",
                        statistics.eased_periods);
  }
  return text;
}

}  // namespace youbot_base_sim
