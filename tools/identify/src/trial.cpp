#include "youbot_base_sim/identify/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "youbot_base_sim/identify/least_squares.h"

namespace youbot_base_sim {

namespace {

constexpr double kMinScatter = 0.1;  // of residuals, for sigma: less is luck, since readings are rounded to as much
constexpr double kWorth = 1e-3;      // share of the held-out error that a parameter must take away

/// J^T J of the rows that are fitted, over their variance, and of what is expected.
Eigen::MatrixXd normal_of(const Comparison& comparison, const Trial& trial, double variance = 1) {
  Eigen::MatrixXd normal = normal_matrix(trial.jacobian(comparison.training(), Eigen::all)) / variance;
  normal.diagonal().head(static_cast<Eigen::Index>(trial.free.size())) += trial.weight(trial.free).cwiseAbs2();
  return normal;
}

/// The unknowns with the k-th free parameter at its start, to which the others adapt to first order.
Eigen::VectorXd without(const Comparison& comparison, const Trial& trial, const Scene& start, std::size_t k) {
  const auto fixed = static_cast<Eigen::Index>(k);
  const Parameter& p = trial.parameter(k);
  return trial.clamped(trial.x +
                       step_back(normal_of(comparison, trial), fixed, p.get(start) / p.step - trial.x[fixed]));
}

/// Holds the k-th free parameter at its start from now on; `residuals` are those there.
void put_back(Trial& trial, const Scene& start, std::size_t k, const Eigen::VectorXd& x, Eigen::VectorXd residuals) {
  trial.candidate = trial.with(x);
  trial.parameter(k).set(trial.candidate.scene, trial.parameter(k).get(start));
  std::vector<std::size_t> others(trial.size());
  std::iota(others.begin(), others.end(), 0);
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
  trial.free.erase(trial.free.begin() + static_cast<std::ptrdiff_t>(k));
  trial.x = x(others);
  trial.residuals = std::move(residuals);
  trial.jacobian = Eigen::MatrixXd(trial.jacobian(Eigen::all, others));
}

/// The least missed is found to first order, then tried by simulation.
void eliminate(const Comparison& comparison, const Scene& start, Trial& trial, std::vector<std::string>& lines) {
  std::vector<bool> needed(trial.table->size(), false);
  const std::size_t all = trial.free.size();
  for (;;) {
    const double error = comparison.held_out_error(trial.residuals), limit = (1 + kWorth) * error;
    double min_error = limit;
    std::optional<std::size_t> best;
    Eigen::VectorXd there;
    for (std::size_t k = 0; k < trial.free.size(); ++k) {
      if (needed[trial.free[k]]) continue;
      const Eigen::VectorXd x = without(comparison, trial, start, k);
      const double found = comparison.held_out_error(trial.residuals + trial.jacobian * (x - trial.x));
      if (found > min_error) continue;
      min_error = found;
      best = k;
      there = x;
    }
    if (!best) break;
    const Parameter& p = trial.parameter(*best);
    const Eigen::VectorXd residuals = comparison.residuals({trial.with(there)}).col(0);
    if (comparison.held_out_error(residuals) > limit) {
      needed[trial.free[*best]] = true;
      continue;
    }
    lines.push_back(fmt::format(
        "{}: fitted, {:.4g} {} does not lower the held-out error ({:.4g}; without {:.4g}); "
        "drive {}",
        p.name(), p.get(trial.candidate.scene), p.unit, error, comparison.held_out_error(residuals), p.drive));
    put_back(trial, start, *best, there, residuals);
  }
  if (trial.free.size() == all) return;
  minimize(comparison, trial);
  eliminate(comparison, start, trial, lines);  // the others may be missed less now
}

/// Held-out errors without each free parameter.
std::vector<double> errors_without(const Comparison& comparison, const Scene& start, const Trial& trial) {
  std::vector<Candidate> candidates;
  for (std::size_t k = 0; k < trial.free.size(); ++k)
    candidates.push_back(trial.with(without(comparison, trial, start, k)));
  const Eigen::MatrixXd residuals = comparison.residuals(candidates);
  std::vector<double> errors;
  for (Eigen::Index k = 0; k < residuals.cols(); ++k) errors.push_back(comparison.held_out_error(residuals.col(k)));
  return errors;
}

}  // namespace

double Comparison::held_out_error(const Eigen::VectorXd& residuals) const {
  return held_out_.empty() ? 0 : residuals(held_out_).norm() / std::sqrt(held_out_.size());
}

double Comparison::variance(const Eigen::VectorXd& residuals) const {
  double product = 0, square = 0;
  for (Eigen::Index k = 0; k < rows(); ++k) {
    const Eigen::Index before = before_[static_cast<std::size_t>(k)];
    if (before < 0) continue;
    product += residuals[k] * residuals[before];
    square += residuals[k] * residuals[k];
  }
  const double alike = std::clamp(square > 0 ? product / square : 0, 0.0, 0.95);
  return std::max(residuals.squaredNorm() / static_cast<double>(rows()), kMinScatter * kMinScatter) * (1 + alike) /
         (1 - alike);
}

void Comparison::add_row(bool held_out, Eigen::Index before) {
  (held_out ? held_out_ : training_).push_back(static_cast<int>(rows()));
  before_.push_back(before);
}

Eigen::VectorXd Trial::unknowns(const Candidate& other) const {
  Eigen::VectorXd values(size());
  for (std::size_t k = 0; k < free.size(); ++k) values[k] = parameter(k).get(other.scene) / parameter(k).step;
  for (std::size_t r = 0; r < other.clocks.size(); ++r)
    values.segment<2>(clock_of(r)) << other.clocks[r].offset / kOffsetStep, other.clocks[r].stretch / kStretchStep;
  for (std::size_t r = 0; r < other.phi.size(); ++r) values.segment<kWheels>(angles_of(r)) = other.phi[r] / kAngleStep;
  return values;
}

Candidate Trial::with(const Eigen::VectorXd& values) const {
  Candidate other = candidate;
  for (std::size_t k = 0; k < free.size(); ++k) parameter(k).set(other.scene, values[k] * parameter(k).step);
  for (std::size_t r = 0; r < other.clocks.size(); ++r)
    other.clocks[r] = {values[clock_of(r)] * kOffsetStep, values[clock_of(r) + 1] * kStretchStep};
  for (std::size_t r = 0; r < other.phi.size(); ++r) other.phi[r] = values.segment<kWheels>(angles_of(r)) * kAngleStep;
  return other;
}

Eigen::VectorXd Trial::bounds(double Parameter::*bound, double of_others) const {
  Eigen::VectorXd bounds = Eigen::VectorXd::Constant(size(), of_others);
  for (std::size_t k = 0; k < free.size(); ++k) bounds[k] = parameter(k).*bound / parameter(k).step;
  return bounds;
}

Trial trial_of(const std::vector<Parameter>& table, const Candidate& candidate) {
  const Eigen::VectorXd nothing = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(table.size()));
  return {&table, candidate, {}, nothing, nothing, {}, {}, {}};
}

void linearize(const Comparison& comparison, Trial& trial, const Eigen::VectorXd& x) {
  const Eigen::VectorXd max = trial.max();
  const Eigen::Index n = x.size();
  Eigen::RowVectorXd steps(n);
  std::vector<Candidate> candidates;
  for (Eigen::Index k = 0; k < n; ++k) {
    Eigen::VectorXd there = x;
    there[k] += x[k] + 1 <= max[k] ? 1 : -1;
    steps[k] = there[k] - x[k];
    candidates.push_back(trial.with(there));
  }
  candidates.push_back(trial.with(x));
  const Eigen::MatrixXd results = comparison.residuals(candidates);
  trial.x = x;
  trial.residuals = results.col(n);
  trial.jacobian = (results.leftCols(n).colwise() - trial.residuals).array().rowwise() / steps.array();
}

Eigen::VectorXd minimize_once(const Comparison& comparison, Trial& trial) {
  // The better the records fit, the less counts what is expected, since they determine parameters themselves.
  const double scatter = std::sqrt(trial.residuals.squaredNorm() / static_cast<double>(trial.residuals.size()));
  const auto free = static_cast<Eigen::Index>(trial.free.size());
  const Eigen::VectorXd expected = trial.expected(trial.free);
  const Eigen::VectorXd weight = std::min(1.0, scatter) * trial.weight(trial.free);
  const std::vector<int>& training = comparison.training();
  const auto trained = static_cast<Eigen::Index>(training.size());
  Eigen::VectorXd latest = trial.x, residuals = trial.residuals;  // there, which spares a simulation
  const auto evaluate = [&](const Eigen::VectorXd& x, Eigen::VectorXd& rows, Eigen::MatrixXd* jacobian) {
    if (x != latest) {
      residuals = comparison.residuals({trial.with(x)}).col(0);
      latest = x;
    }
    rows.head(trained) = residuals(training);
    if (jacobian && x != trial.x) {
      const Eigen::VectorXd step = x - trial.x;
      const Eigen::VectorXd missed = residuals - trial.residuals - trial.jacobian * step;
      trial.jacobian += missed * step.transpose() / step.squaredNorm();
      trial.residuals = residuals;
      trial.x = x;
    }
    rows.tail(free) = weight.cwiseProduct(x.head(free) - expected);
    if (!jacobian) return;
    jacobian->setZero().topRows(trained) = trial.jacobian(training, Eigen::all);
    jacobian->bottomRows(free).diagonal() = weight;
  };
  return minimize_squares(evaluate, trained + free, trial.x, trial.min(), trial.max());
}

void minimize(const Comparison& comparison, Trial& trial) {
  constexpr int kTimes = 4;
  constexpr double kBetter = 0.995;
  for (int k = 0; k < kTimes; ++k) {
    const double before = trial.residuals(comparison.training()).norm();
    linearize(comparison, trial, minimize_once(comparison, trial));
    if (trial.residuals(comparison.training()).norm() > kBetter * before) break;
  }
  trial.candidate = trial.with(trial.x);
}

void finish(const Comparison& comparison, const Scene& start, Trial& trial, Fit& fit) {
  const std::vector<std::size_t> all = trial.free;
  const Eigen::MatrixXd covariance = inverse_of(normal_of(comparison, trial, comparison.variance(trial.residuals)));
  fit.sigma = covariance.diagonal().cwiseSqrt();
  eliminate(comparison, start, trial, fit.unidentifiable);
  const std::vector<double> errors = errors_without(comparison, start, trial);
  std::vector<Eigen::Index> kept;
  for (std::size_t k = 0; k < trial.free.size(); ++k) {
    const Parameter& p = trial.parameter(k);
    kept.push_back(std::find(all.begin(), all.end(), trial.free[k]) - all.begin());
    fit.numbers.push_back({&p, p.get(trial.candidate.scene), fit.sigma[kept.back()] * p.step, errors[k]});
  }
  const Eigen::VectorXd sigma = fit.sigma(kept);
  fit.correlation = covariance(kept, kept).cwiseQuotient(sigma * sigma.transpose());
  fit.best = trial.candidate;
  fit.error_after = comparison.held_out_error(trial.residuals);
}

}  // namespace youbot_base_sim
