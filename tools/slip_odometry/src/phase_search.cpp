#include "youbot_base_sim/slip_odometry/phase_search.h"

#include <algorithm>
#include <cmath>

namespace youbot_base_sim {

namespace {

constexpr double kThird = 2 * M_PI / 3;

/// The step of candidate k and wheel i: -1, 0 or 1.
int level(int k, int i) {
  const int row = k / 3, column = k % 3;
  const std::array<int, kWheels> levels = {row, column, row + column, row + 2 * column};
  return (levels[static_cast<std::size_t>(i)] + 1) % 3 - 1;
}

/// The parts of four torques that move the base: what wheels do against each other depends on rounded readings.
Eigen::Array3d moving_parts(const Wheels& torque) {
  const double fl = torque[0], fr = torque[1], bl = torque[2], br = torque[3];
  return 0.25 * Eigen::Array3d(fl + fr + bl + br, fr + bl - fl - br, fr + br - fl - bl);
}

}  // namespace

PhaseSearch::PhaseSearch(int rollers)
    : pitch_(2 * M_PI / rollers),
      step_(pitch_ / 3),
      center_(Wheels::Zero()),
      sigma_(Wheels::Constant(pitch_ / std::sqrt(12))) {}

Wheels PhaseSearch::phases(int k) const {
  Wheels phases = center_;
  for (int i = 0; i < kWheels; ++i) phases[i] += step_ * level(k, i);
  return phases;
}

bool PhaseSearch::update(const Wheels& measured, const Torques& expected, double dt) {
  constexpr double kSmall = 0.06, kMemory = 10;  // share of the mean torque that candidates may be off; s
  time_ = std::min(time_ + dt, kMemory);
  size_ += dt / time_ * (measured.abs().mean() - size_);
  for (std::size_t k = 0; k < kCandidates; ++k) {
    // Robustly: where rollers change, single torques are far off.
    const Eigen::Array3d off = moving_parts(measured - expected[k]) / (kSmall * size_);
    if (size_ > 0) misfit_[k] += dt * (1 + off.square()).log().sum();
  }
  second_ += dt;
  if (second_ < 1) return false;
  Eigen::Array<double, 2, kWheels> parts = Eigen::Array<double, 2, kWheels>::Zero();
  for (int k = 0; k < kCandidates; ++k) {
    for (int i = 0; i < kWheels; ++i) {
      const double angle = kThird * level(k, i);
      parts.col(i) += misfit_[static_cast<std::size_t>(k)] / second_ * Eigen::Array2d(std::sin(angle), std::cos(angle));
    }
  }
  seconds_.push_back(parts);
  misfit_.fill(0);
  second_ = 0;
  return finish_step();
}

/// Moves to the phases of least misfit once all are known well within a step.
bool PhaseSearch::finish_step() {
  constexpr std::size_t kFewest = 5, kMost = 1000;  // s
  constexpr double kKnown = 0.3;                    // rad, of a circle of three steps
  constexpr double kSlight = 0.05;                  // parts of misfits that tell nothing
  constexpr double kUneven = 0.25;                  // steps: what the misfit's shape, no sine, may do
  if (seconds_.size() > kMost) seconds_.erase(seconds_.begin());
  if (seconds_.size() < kFewest) return false;
  const auto n = static_cast<double>(seconds_.size());
  Eigen::Array<double, 2, kWheels> mean = Eigen::Array<double, 2, kWheels>::Zero(), variance = mean + kSlight * kSlight;
  for (const auto& parts : seconds_) mean += parts / n;
  for (const auto& parts : seconds_) variance += (parts - mean).square() / (n * (n - 1));
  const Wheels square = mean.square().colwise().sum().transpose().max(1e-300);
  const Wheels across = (mean.row(1).square() * variance.row(0) + mean.row(0).square() * variance.row(1)).transpose();
  const Wheels error = across.sqrt() / square;
  const bool first = 3.5 * step_ > pitch_;
  if (!(error < (first ? 3 : 1) * kKnown).all()) return false;
  Wheels shift;
  for (int i = 0; i < kWheels; ++i) shift[i] = step_ / kThird * std::atan2(-mean(0, i), -mean(1, i));
  center_ += shift;
  center_ -= pitch_ * (center_ / pitch_).round();
  sigma_ = step_ * ((error / kThird).square() + kUneven * kUneven).sqrt();
  if (first || (shift.abs() < step_ / 2).all()) step_ = step_ > pitch_ / 10 ? step_ / 2 : 0;
  seconds_.clear();
  return true;
}

}  // namespace youbot_base_sim
