#include "youbot_base_sim/drive/prescribed_wheels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "youbot_base_sim/physics/dry_bearings.h"

namespace youbot_base_sim {

namespace {

constexpr double kDecay = 1e-3;  // s, of an error of the rates

/// Reinsch's smoothing spline of one wheel: values g and second derivatives gamma minimise
/// sum (y - g)^2 + alpha * integral g''^2, for which (H + alpha Q' Q) gamma = Q' y and g = y - alpha Q gamma.
/// H (tridiagonal) and Q (three entries a column) hold the distances of the rows.
class SmoothingSpline {
 public:
  SmoothingSpline(const std::vector<double>& t, std::vector<double> y) : y_(std::move(y)), n_(y_.size()) {
    for (std::size_t k = 0; k + 1 < n_; ++k) length_.push_back(t[k + 1] - t[k]);
  }

  /// Solves for `alpha`, s^3. Returns the root mean square of y - g, rad.
  double solve(double alpha);

  const std::vector<double>& values() const { return g_; }
  const std::vector<double>& second_derivatives() const { return gamma_; }

 private:
  // Column k of Q, of the rows k, k + 1 and k + 2.
  std::array<double, 3> column(std::size_t k) const {
    const double a = 1 / length_[k], b = 1 / length_[k + 1];
    return {a, -a - b, b};
  }

  std::vector<double> y_, length_, g_, gamma_;
  std::size_t n_;
};

// L D L' of a matrix with two diagonals beside the main one.
double SmoothingSpline::solve(double alpha) {
  const std::size_t m = n_ < 3 ? 0 : n_ - 2;
  std::vector<double> d(m), l_1(m), l_2(m), x(m);
  for (std::size_t k = 0; k < m; ++k) {
    const auto q = column(k);
    double diagonal = (length_[k] + length_[k + 1]) / 3 + alpha * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
    x[k] = q[0] * y_[k] + q[1] * y_[k + 1] + q[2] * y_[k + 2];
    if (k >= 2) {
      diagonal -= l_2[k] * l_2[k] * d[k - 2];
      x[k] -= l_2[k] * x[k - 2];
    }
    if (k >= 1) {
      diagonal -= l_1[k] * l_1[k] * d[k - 1];
      x[k] -= l_1[k] * x[k - 1];
    }
    d[k] = diagonal;
    if (k + 1 < m) {
      const auto next = column(k + 1);
      double beside = length_[k + 1] / 6 + alpha * (q[1] * next[0] + q[2] * next[1]);
      if (k >= 1) beside -= l_2[k + 1] * d[k - 1] * l_1[k];
      l_1[k + 1] = beside / diagonal;
      if (k + 2 < m) l_2[k + 2] = alpha * q[2] * column(k + 2)[0] / diagonal;
    }
  }
  for (std::size_t k = m; k-- > 0;) {
    x[k] /= d[k];
    if (k + 1 < m) x[k] -= l_1[k + 1] * x[k + 1];
    if (k + 2 < m) x[k] -= l_2[k + 2] * x[k + 2];
  }
  g_ = y_;
  gamma_.assign(n_, 0.0);
  for (std::size_t k = 0; k < m; ++k) {
    const auto q = column(k);
    for (std::size_t j = 0; j < 3; ++j) g_[k + j] -= alpha * q[j] * x[k];
    gamma_[k + 1] = x[k];
  }
  double square = 0;
  for (std::size_t k = 0; k < n_; ++k) square += (y_[k] - g_[k]) * (y_[k] - g_[k]);
  return std::sqrt(square / static_cast<double>(n_));
}

/// Solves for the smoothest spline that departs from the rows by `deviation` (rad) in the mean.
void smoothen(SmoothingSpline& spline, double duration, double deviation) {
  // At these weights it passes through the rows, but for rounding, and is a straight line.
  const double cube = duration * duration * duration;
  double low = 1e-30 * cube, high = 1e6 * cube;
  if (deviation <= 0) {
    spline.solve(0);
    return;
  }
  if (spline.solve(high) <= deviation) return;
  constexpr int kHalvings = 40;
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = std::sqrt(low) * std::sqrt(high);
    (spline.solve(middle) > deviation ? high : low) = middle;
  }
  spline.solve(low);
}

}  // namespace

Wheels WheelCubic::angle(double t) const {
  const double s = (t - start) / length;
  return phi + s * (length * dphi + s * (quadratic() + s * cubic()));
}

Wheels WheelCubic::rate(double t) const {
  const double s = (t - start) / length;
  return dphi + s / length * (2 * quadratic() + 3 * s * cubic());
}

Wheels WheelCubic::acceleration(double t) const {
  const double s = (t - start) / length;
  return (2 * quadratic() + 6 * s * cubic()) / (length * length);
}

WheelSpline::WheelSpline(WheelTable table, double resolution)
    : table_(std::move(table)), angle_(table_.values), acceleration_(table_.t.size(), Wheels::Zero()) {
  for (int i = 0; i < kWheels; ++i) {
    std::vector<double> y(table_.t.size());
    for (std::size_t k = 0; k < y.size(); ++k) y[k] = table_.values[k][i];
    SmoothingSpline spline(table_.t, std::move(y));
    smoothen(spline, table_.t.back() - table_.t.front(), resolution / std::sqrt(12.0));
    for (std::size_t k = 0; k < table_.t.size(); ++k) {
      angle_[k][i] = spline.values()[k];
      acceleration_[k][i] = spline.second_derivatives()[k];
    }
  }
}

WheelSpline::Place WheelSpline::place(double time) const {
  const std::vector<double>& t = table_.t;
  std::size_t row = row_.load(std::memory_order_relaxed);
  while (row > 0 && time < t[row]) --row;
  while (row + 2 < t.size() && time >= t[row + 1]) ++row;
  row_.store(row, std::memory_order_relaxed);
  const double length = t[row + 1] - t[row];
  return {row, length, (time - t[row]) / length};
}

Wheels WheelSpline::acceleration(double t) const {
  const auto [row, length, share] = place(t);
  if (share < 0 || share > 1) return Wheels::Zero();
  return (1 - share) * acceleration_[row] + share * acceleration_[row + 1];
}

Wheels WheelSpline::rate(double t) const {
  const auto [row, length, share] = place(t);
  const double s = std::clamp(share, 0.0, 1.0), rest = 1 - s;
  return (angle_[row + 1] - angle_[row]) / length +
         length / 6 * ((3 * s * s - 1) * acceleration_[row + 1] - (3 * rest * rest - 1) * acceleration_[row]);
}

Wheels WheelSpline::angle(double t) const {
  const auto [row, length, share] = place(t);
  const double s = std::clamp(share, 0.0, 1.0), rest = 1 - s;
  const Wheels inside =
      rest * angle_[row] + s * angle_[row + 1] +
      length * length / 6 *
          ((rest * rest * rest - rest) * acceleration_[row] + (s * s * s - s) * acceleration_[row + 1]);
  return inside + (share - s) * length * rate(t);
}

PrescribedWheels::PrescribedWheels(const RobotParameters& robot, std::shared_ptr<const WheelMotion> motion)
    : motion_(std::move(motion)), J_1_(robot.J_1) {}

RobotParameters PrescribedWheels::driven(const RobotParameters& robot) {
  RobotParameters driven = robot;
  driven.wheels_prescribed = true;
  driven.mu_1.setConstant(robot.J_1 / kDecay);
  driven.dry_friction.setZero();
  return driven;
}

Wheels PrescribedWheels::value(double t) const { return J_1_ * (motion_->acceleration(t) + motion_->rate(t) / kDecay); }

Wheels PrescribedWheels::reaction(const RobotParameters& robot, const Wheels& dphi, const Wheels& F_X, double t) const {
  return J_1_ * motion_->acceleration(t) + robot.mu_1 * dphi + DryBearings(robot).wheels.torque(dphi) + robot.R * F_X;
}

}  // namespace youbot_base_sim
