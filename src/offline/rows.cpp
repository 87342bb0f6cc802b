#include "youbot_base_sim/offline/rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace youbot_base_sim {

constexpr double kMaxUnseen = 0.1;  // s, between two looks at the energy

void RowLoop::look() {
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
  at_look_();
}

bool RowLoop::next() {
  const double duration = simulation_.scene().duration;
  if (rows_ == 0) {
    look();
  } else {
    if (t_ >= duration) return false;
    // The last multiple of 1 / output_rate may be the end but for rounding.
    t_ = static_cast<double>(rows_) / simulation_.scene().output_rate;
    if (t_ >= duration * (1 - 1e-12)) t_ = duration;
    advance_to(t_);
  }
  ++rows_;
  return true;
}

void RowLoop::advance_to(double t) {
  const State before = simulation_.state(), &x = simulation_.state();
  const RobotParameters& robot = simulation_.scene().robot;
  if (t - simulation_.time() > kMaxUnseen) {
    const double period = simulation_.scene().solver.control_period;
    const double interval = period > 0 ? period * std::max(1.0, std::floor(kMaxUnseen / period)) : kMaxUnseen;
    for (double k = std::floor(simulation_.time() / interval * (1 + 1e-9)) + 1; k * interval < t * (1 - 1e-9); ++k) {
      simulation_.advance_to(k * interval);
      look();
    }
  }
  simulation_.advance_to(t);
  const double dx = x.x() - before.x(), dy = x.y() - before.y(), dpsi = x.psi() - before.psi();
  path_.base += std::sqrt(dx * dx + dy * dy + (robot.h * robot.h + robot.l * robot.l) * (dpsi * dpsi));
  path_.wheels += robot.R * (x.phi() - before.phi()).abs();
  if (!x.values.allFinite()) throw std::runtime_error(fmt::format("the state is no longer finite at t = {} s", t));
  look();
}

}  // namespace youbot_base_sim
