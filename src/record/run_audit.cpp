#include "youbot_base_sim/record/run_audit.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/record/twin.h"
#include "youbot_base_sim/text/version.h"

namespace youbot_base_sim {

namespace {

constexpr double kMaxUnseen = 0.1;    // s, between two looks at the energy
constexpr double kLeastSpeed = 1e-3;  // m/s, of a robot that hardly moves

// Processor time of this thread rather than wall time, so that other programs do not count.
double thread_cpu_time() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

std::vector<double> numbers(const Wheels& w) { return {w.data(), w.data() + w.size()}; }

/// How far wheels that were held while their momentum counted may have moved the base, m. The speed that they gave it
/// dies down: in the motions tried it moved the base as far as it would in 0.002 to 1 s.
double displacement_by_forced_holds(const Simulation& simulation) {
  constexpr double kLasts = 1;  // s
  return simulation.statistics().forced_hold_speed * std::min(simulation.time(), kLasts);
}

/// How well the energy balance must close, as a share of the energy that the motion had or exchanged.
double allowed_share(const Simulation& simulation) {
  const Scene& scene = simulation.scene();
  const double tolerance = scene.solver.relative_tolerance;
  double share = std::max(std::min(1e3 * tolerance, 1e-3), 10 * tolerance);
  if (std::holds_alternative<std::shared_ptr<const WheelMotion>>(scene.drive)) {
    // Drives of prescribed wheels exert what friction does, which rounding of the slip blurs.
    constexpr double kRounding = 2e-14;  // m/s
    share = std::max(share, kRounding / simulation.regularization_speed());
  }
  return std::clamp(share, 1e-9, 0.1);
}

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
  if (taken > slowest_.cpu_time) slowest_ = {t_, t - t_, taken};
  if (taken > t - t_) ++late_;
}

double RunCost::percentile(double share) const {
  if (cpu_times_.empty()) return 0;
  std::vector<float> sorted = cpu_times_;
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(sorted.size() - 1));
  std::nth_element(sorted.begin(), sorted.begin() + rank, sorted.end());
  return sorted[static_cast<std::size_t>(rank)];
}

void EnergyAudit::add_row(const Simulation& simulation) {
  const double interval = simulation.time() - t_;
  const double power = sum((simulation.torque() * simulation.state().dphi()).abs());
  drive_work_ += 0.5 * (power + power_) * interval;
  longest_interval_ = std::max(longest_interval_, interval);
  power_ = power;
  t_ = simulation.time();
  const double kinetic_energy = simulation.kinetic_energy(), error = simulation.energy_balance_error(kinetic_energy);
  max_kinetic_energy_ = std::max(max_kinetic_energy_, kinetic_energy);
  // NaN must persist.
  if (error > max_balance_error_ || std::isnan(error)) max_balance_error_ = error;
}

bool RowLoop::next() {
  const Scene& scene = simulation_.scene();
  if (rows_ > 0) {
    if (t_ >= scene.duration) return false;
    // The last multiple of 1 / output_rate may be the end but for rounding.
    t_ = static_cast<double>(rows_) / scene.output_rate;
    if (t_ >= scene.duration * (1 - 1e-12)) t_ = scene.duration;
    const State before = simulation_.state();
    audit_until(t_);
    simulation_.advance_to(t_);
    add_path(before);
    if (!simulation_.state().values.allFinite()) {
      throw std::runtime_error(fmt::format("the state is no longer finite at t = {} s", t_));
    }
  }
  energy_.add_row(simulation_);
  ++rows_;
  return true;
}

void RowLoop::audit_until(double t) {
  if (t - simulation_.time() <= kMaxUnseen) return;
  const double period = simulation_.scene().solver.control_period;
  const double interval = period > 0 ? period * std::max(1.0, std::floor(kMaxUnseen / period)) : kMaxUnseen;
  for (double k = std::floor(simulation_.time() / interval * (1 + 1e-9)) + 1; k * interval < t * (1 - 1e-9); ++k) {
    simulation_.advance_to(k * interval);
    energy_.add_row(simulation_);
  }
}

void RowLoop::add_path(const State& before) {
  const State& x = simulation_.state();
  const RobotParameters& robot = simulation_.scene().robot;
  const double dx = x.x() - before.x(), dy = x.y() - before.y(), dpsi = x.psi() - before.psi();
  path_.base += std::sqrt(dx * dx + dy * dy + (robot.h * robot.h + robot.l * robot.l) * (dpsi * dpsi));
  path_.wheels += robot.R * (x.phi() - before.phi()).abs();
}

std::string unreliability_reason(const Simulation& simulation, const EnergyAudit& energy, const PathLength& path) {
  if (const std::uint64_t steps = simulation.statistics().fallback_steps) {
    return fmt::format("{} fallback steps, of first order, went on where the bound of work was reached", steps);
  }
  const double promised = promised_error(simulation, path);
  const double moved = displacement_by_forced_holds(simulation);
  if (moved > promised) {
    return fmt::format(
        "wheels that had not stopped chattering between two rollers were made to rest on both: the base may be off by "
        "{:.2g} m, where {:.2g} m are allowed",
        moved, promised);
  }
  const Scene& scene = simulation.scene();
  const Method* method = find_method(simulation.method());
  if (method && scene.solver.control_period == 0 && scene.solver.relative_tolerance < method->finest_tolerance) {
    return fmt::format("{} keeps no relative tolerance below {:g} where torques change with time", method->name,
                       method->finest_tolerance);
  }
  // The scale includes the energy of a speed that friction can give the base unseen between two rows.
  const double speed = kLeastSpeed + scene.floor.f.maxCoeff() * scene.floor.g * energy.longest_interval();
  const double exchanged = std::max(energy.max_kinetic_energy(), energy.drive_work());
  const double allowed = allowed_share(simulation) * (exchanged + 0.5 * scene.robot.m_s() * speed * speed);
  if (energy.max_balance_error() <= allowed && std::isfinite(exchanged)) return "";
  return fmt::format("the energy balance is off by {:.2g} J of {:.2g} J, where {:.2g} J are allowed",
                     energy.max_balance_error(), exchanged, allowed);
}

std::string unreliability_reason(const Simulation& simulation, const RowLoop& rows, const Twin* twin) {
  const std::string doubt = unreliability_reason(simulation, rows.energy(), rows.path());
  return doubt.empty() && twin ? twin->doubt(simulation, rows.path()) : doubt;
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
  json["reliable"] = completed && unreliability_reason(simulation, rows, twin).empty();
  if (twin) {
    json["check"] = {{"position_difference", twin->position_difference()},
                     {"heading_difference", twin->heading_difference()},
                     {"promised", promised_error(simulation, rows.path())}};
  }
  const RunCost::Period& slowest = cost.slowest();
  json["cpu_time"] = cost.cpu_time();
  json["slowest_period"] = {{"start", slowest.start},
                            {"length", slowest.length},
                            {"cpu_time", slowest.cpu_time},
                            {"cost", slowest.length > 0 ? slowest.cpu_time / slowest.length : 0}};
  json["periods"] = {
      {"count", cost.periods()}, {"late", cost.late_periods()}, {"cpu_time_99_9", cost.percentile(0.999)}};
  json["energy"] = {{"max_balance_error", rows.energy().max_balance_error()},
                    {"max_kinetic", rows.energy().max_kinetic_energy()},
                    {"drive_work", rows.energy().drive_work()}};
  json["path_length"] = {{"base", rows.path().base}, {"wheels", numbers(rows.path().wheels)}};
  return json.dump(2) + "\n";
}

std::string summary_text(const Simulation& simulation, double wall_time, const Twin* twin) {
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
  if (twin) {
    text += fmt::format("error bar       {:.2g} m, {:.2g} rad: how far a twin at half the tolerance parts from it\n",
                        twin->position_difference(), twin->heading_difference());
  }
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
    const Wheels& off = record->time_off_floor;
    text += fmt::format("minimum normal reactions, N: {}", named(record->min_N));
    if ((off > 0).any()) text += fmt::format("; off the floor, s: {}", named(off));
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
  if (statistics.eased_periods > 0) {
    text += fmt::format("note: in {} milliseconds wheels that chatter were held early to bound the work\n",
                        statistics.eased_periods);
  }
  return text;
}

}  // namespace youbot_base_sim
