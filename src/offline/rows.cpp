#include "youbot_base_sim/offline/rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace youbot_base_sim {

namespace {

constexpr double kMaxUnseen = 0.1;  // s, between two looks at the energy

}  // namespace

void RowLoop::audit() {
  const double interval = simulation_.time() - audited_;
  const double power = sum((simulation_.torque() * simulation_.state().dphi()).abs());
  energy_.drive_work += 0.5 * (power + power_) * interval;
  energy_.longest_interval = std::max(energy_.longest_interval, interval);
  power_ = power;
  audited_ = simulation_.time();
  energy_.max_kinetic_energy = std::max(energy_.max_kinetic_energy, simulation_.kinetic_energy());
  const double error = simulation_.energy_balance_error();
  // NaN must persist.
  if (error > energy_.max_balance_error || std::isnan(error)) energy_.max_balance_error = error;
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
  audit();
  ++rows_;
  return true;
}

void RowLoop::audit_until(double t) {
  if (t - simulation_.time() <= kMaxUnseen) return;
  const double period = simulation_.scene().solver.control_period;
  const double interval = period > 0 ? period * std::max(1.0, std::floor(kMaxUnseen / period)) : kMaxUnseen;
  for (double k = std::floor(simulation_.time() / interval * (1 + 1e-9)) + 1; k * interval < t * (1 - 1e-9); ++k) {
    simulation_.advance_to(k * interval);
    audit();
  }
}

void RowLoop::add_path(const State& before) {
  const State& x = simulation_.state();
  const RobotParameters& robot = simulation_.scene().robot;
  const double dx = x.x() - before.x(), dy = x.y() - before.y(), dpsi = x.psi() - before.psi();
  path_.base += std::sqrt(dx * dx + dy * dy + (robot.h * robot.h + robot.l * robot.l) * (dpsi * dpsi));
  path_.wheels += robot.R * (x.phi() - before.phi()).abs();
}

}  // namespace youbot_base_sim
