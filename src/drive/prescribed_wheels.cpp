#include "youbot_base_sim/drive/prescribed_wheels.h"

#include <Eigen/Sparse>
#include <algorithm>
#include <cmath>
#include <utility>

#include "youbot_base_sim/physics/dry_bearings.h"

namespace youbot_base_sim {

namespace {

constexpr double kDecay = 1e-3;  // s, of an error of the rates

/// The values of a spline at its rows, rad, and its second derivatives at all but the first and the last, rad/s^2.
struct Spline {
  Eigen::VectorXd values, second_derivatives;
};

/// Reinsch's smoothing spline of one wheel, the smoothest that departs from the rows (t, y) by `deviation` (rad) in the
/// mean: values g and second derivatives gamma minimise sum (y - g)^2 + alpha * integral g''^2, for which
/// (H + alpha Q' Q) gamma = Q' y and g = y - alpha Q gamma. H (tridiagonal) and Q (three entries a column) hold the
/// distances of the rows.
Spline smoothest(const std::vector<double>& t, const Eigen::VectorXd& y, double deviation) {
  using Matrix = Eigen::SparseMatrix<double>;
  Matrix Q(y.size(), y.size() - 2), H(Q.cols(), Q.cols());
  std::vector<Eigen::Triplet<double>> q, h;
  for (int k = 0; k < Q.cols(); ++k) {
    const double length = t[k + 1] - t[k], next = t[k + 2] - t[k + 1];
    q.insert(q.end(), {{k, k, 1 / length}, {k + 1, k, -1 / length - 1 / next}, {k + 2, k, 1 / next}});
    h.emplace_back(k, k, (length + next) / 3);
    if (k > 0) h.insert(h.end(), {{k, k - 1, length / 6}, {k - 1, k, length / 6}});
  }
  Q.setFromTriplets(q.begin(), q.end());
  H.setFromTriplets(h.begin(), h.end());
  const Matrix square = Q.transpose() * Q;
  Spline spline;
  const auto solve = [&](double alpha) {  // s^3; returns the root mean square of y - g, rad
    const Eigen::SimplicialLDLT<Matrix, Eigen::Lower, Eigen::NaturalOrdering<int>> solver(H + alpha * square);
    spline.second_derivatives = solver.solve(Q.transpose() * y);
    const Eigen::VectorXd off = alpha * (Q * spline.second_derivatives);
    spline.values = y - off;
    double squares = 0;  // in order: the same bits everywhere
    for (Eigen::Index k = 0; k < off.size(); ++k) squares += off[k] * off[k];
    return std::sqrt(squares / static_cast<double>(y.size()));
  };
  double low = 0;
  if (deviation > 0) {
    // At these weights it passes through the rows, but for rounding, and is a straight line.
    constexpr int kHalvings = 40;
    const double duration = t.back() - t.front(), cube = duration * duration * duration;
    double high = 1e6 * cube;
    if (solve(high) <= deviation) return spline;
    low = 1e-30 * cube;
    for (int k = 0; k < kHalvings; ++k) {
      const double middle = std::sqrt(low) * std::sqrt(high);
      (solve(middle) > deviation ? high : low) = middle;
    }
  }
  solve(low);
  return spline;
}

}  // namespace

WheelSpline::WheelSpline(WheelTable table, double resolution)
    : table_(std::move(table)), angle_(table_.values), acceleration_(table_.t.size(), Wheels::Zero()) {
  for (int i = 0; i < kWheels; ++i) {
    const auto rows = static_cast<Eigen::Index>(table_.t.size());
    if (rows < 3) continue;  // a straight line
    Eigen::VectorXd y(rows);
    for (Eigen::Index k = 0; k < rows; ++k) y[k] = table_.values[k][i];
    const Spline spline = smoothest(table_.t, y, resolution / std::sqrt(12.0));
    for (Eigen::Index k = 0; k < rows; ++k) angle_[k][i] = spline.values[k];
    for (Eigen::Index k = 1; k + 1 < rows; ++k) acceleration_[k][i] = spline.second_derivatives[k - 1];
  }
}

WheelSpline::Place WheelSpline::place(double time) const {
  const std::vector<double>& t = table_.t;
  const auto row = static_cast<std::size_t>(std::upper_bound(t.begin() + 1, t.end() - 1, time) - t.begin()) - 1;
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
  const double s = std::clamp(share, 0.0, 1.0), left = 1 - s;
  return (angle_[row + 1] - angle_[row]) / length +
         length / 6 * ((3 * s * s - 1) * acceleration_[row + 1] - (3 * left * left - 1) * acceleration_[row]);
}

Wheels WheelSpline::angle(double t) const {
  const auto [row, length, share] = place(t);
  const double s = std::clamp(share, 0.0, 1.0), left = 1 - s;
  const Wheels inside =
      left * angle_[row] + s * angle_[row + 1] +
      length * length / 6 *
          ((left * left * left - left) * acceleration_[row] + (s * s * s - s) * acceleration_[row + 1]);
  return inside + (share - s) * length * rate(t);
}

double WheelSpline::max_step(double t) const {
  const std::size_t row = place(t).row + 2;
  return row < table_.t.size() ? table_.t[row] - t : kInfinity;
}

PrescribedWheels::PrescribedWheels(const RobotParameters& robot, std::shared_ptr<const WheelMotion> motion)
    : motion_(std::move(motion)), J_1_(robot.J_1) {}

RobotParameters PrescribedWheels::driven(const RobotParameters& robot) {
  RobotParameters driven = robot;
  driven.mu_1.setConstant(robot.J_1 / kDecay);
  driven.dry_friction.setZero();
  return driven;
}

Wheels PrescribedWheels::value(double t) const { return J_1_ * (motion_->acceleration(t) + motion_->rate(t) / kDecay); }

Wheels PrescribedWheels::reaction(const RobotParameters& robot, const Wheels& dphi, const Wheels& F_X, double t) const {
  return J_1_ * motion_->acceleration(t) + robot.mu_1 * dphi + DryBearings(robot).wheels.torque(dphi) + robot.R * F_X;
}

}  // namespace youbot_base_sim
