#include "youbot_base_sim/record/run_audit.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>

namespace youbot_base_sim {

namespace {

// Processor time of this thread rather than wall time, so that other programs do not count.
double thread_cpu_time() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
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
  const double power = (simulation.torque() * simulation.state().dphi()).abs().sum();
  drive_work_ += 0.5 * (power + power_) * interval;
  longest_interval_ = std::max(longest_interval_, interval);
  power_ = power;
  t_ = simulation.time();
  const double kinetic_energy = simulation.kinetic_energy(), error = simulation.energy_balance_error(kinetic_energy);
  max_kinetic_energy_ = std::max(max_kinetic_energy_, kinetic_energy);
  // NaN must persist.
  if (error > max_balance_error_ || std::isnan(error)) max_balance_error_ = error;
}

std::string unreliability_reason(const Simulation& simulation, const EnergyAudit& energy) {
  if (const std::uint64_t steps = simulation.statistics().fallback_steps) {
    return fmt::format("{} fallback steps, of first order, went on where the bound of work was reached", steps);
  }
  const Scene& scene = simulation.scene();
  const double tolerance = scene.solver.relative_tolerance;
  // Motion between two rows is not seen. So the scale includes the energy of a speed that friction can give the base in
  // between, and that of the speed at which relative and absolute tolerance meet.
  const double speed = scene.solver.absolute_tolerance / tolerance +
                       scene.floor.f.maxCoeff() * scene.floor.g * energy.longest_interval();
  const double exchanged = std::max(energy.max_kinetic_energy(), energy.drive_work());
  const double share = std::clamp(std::max(std::min(1e3 * tolerance, 1e-2), 10 * tolerance), 1e-9, 0.1);
  const double allowed = share * (exchanged + 0.5 * scene.robot.m_s() * speed * speed);
  if (energy.max_balance_error() <= allowed && std::isfinite(exchanged)) return "";
  return fmt::format("the energy balance is off by {:.2g} J of {:.2g} J, where {:.2g} J are allowed",
                     energy.max_balance_error(), exchanged, allowed);
}

void PathLength::add_row(const Simulation& simulation) {
  const State& x = simulation.state();
  const RobotParameters& robot = simulation.scene().robot;
  if (started_) {
    base_ += std::hypot(x.x() - last_.x(), x.y() - last_.y(), std::hypot(robot.h, robot.l) * (x.psi() - last_.psi()));
    wheels_ += robot.R * (x.phi() - last_.phi()).abs();
  }
  started_ = true;
  last_ = x;
}

}  // namespace youbot_base_sim
