#include "youbot_base_sim/identify/fit.h"

#include <ceres/cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "youbot_base_sim/identify/comparison.h"
#include "youbot_base_sim/identify/first_guess.h"
#include "youbot_base_sim/identify/inspection.h"
#include "youbot_base_sim/integration/motion_integrator.h"

namespace youbot_base_sim {

namespace {

constexpr double kAngleStep = 0.05;  // rad
constexpr double kGainsWeight = 3;   // of the loops' law: residuals follow each other, so that hundreds count as one
constexpr double kMinScatter = 0.1;  // of residuals, for sigma: less is luck, since readings are rounded to as much

/// A fit in progress. What is unknown are numbers in units of their steps: first the free parameters, then four angles
/// for each record.
struct Trial {
  Candidate candidate;
  std::vector<std::size_t> free;  // the numbers of the free parameters
  std::optional<Scene> law;       // whose gains follow from the loops' law
  Eigen::VectorXd x;              // the unknowns where derivatives were measured, or corrected to
  Eigen::VectorXd residuals;      // there, of all rows
  Eigen::MatrixXd jacobian;       // of these by the unknowns

  const Parameter& parameter(std::size_t k) const { return parameters()[free[k]]; }
  std::size_t size() const { return free.size() + kWheels * candidate.phi.size(); }

  /// Bounds; angles have none.
  Eigen::VectorXd min() const { return bounds(&Parameter::min, -HUGE_VAL); }
  Eigen::VectorXd max() const { return bounds(&Parameter::max, HUGE_VAL); }
  Eigen::VectorXd clamped(const Eigen::VectorXd& values) const { return values.cwiseMax(min()).cwiseMin(max()); }

  /// The unknowns as `other` has them.
  Eigen::VectorXd unknowns(const Candidate& other) const {
    Eigen::VectorXd values(size());
    for (std::size_t k = 0; k < free.size(); ++k) values[k] = parameter(k).get(other.scene) / parameter(k).step;
    for (std::size_t r = 0; r < other.phi.size(); ++r)
      values.segment<kWheels>(angles_of(r)) = other.phi[r] / kAngleStep;
    return values;
  }

  /// The candidate with other unknowns.
  Candidate with(const Eigen::VectorXd& values) const {
    Candidate other = candidate;
    for (std::size_t k = 0; k < free.size(); ++k) parameter(k).set(other.scene, values[k] * parameter(k).step);
    for (std::size_t r = 0; r < other.phi.size(); ++r)
      other.phi[r] = values.segment<kWheels>(angles_of(r)) * kAngleStep;
    return other;
  }

 private:
  std::size_t angles_of(std::size_t record) const { return free.size() + kWheels * record; }

  Eigen::VectorXd bounds(double Parameter::*bound, double of_angles) const {
    Eigen::VectorXd bounds = Eigen::VectorXd::Constant(size(), of_angles);
    for (std::size_t k = 0; k < free.size(); ++k) bounds[k] = parameter(k).*bound / parameter(k).step;
    return bounds;
  }
};

/// Ceres' view of the comparison: the rows that are not held out. Derivatives are measured once, and then corrected in
/// the trial by what each step shows of them (Broyden's method), for a column costs a simulation.
class TrainingCost : public ceres::CostFunction {
 public:
  TrainingCost(const Comparison& comparison, Trial& trial)
      : comparison_(comparison), trial_(trial), x_(trial.x), residuals_(trial.residuals) {
    // The better the records fit, the less the loops' law weighs, since they determine the gains themselves.
    const double scatter = std::sqrt(residuals_.squaredNorm() / static_cast<double>(residuals_.size()));
    weight_ = kGainsWeight * std::min(1.0, scatter);
    for (std::size_t k = 0; k < trial.free.size(); ++k) {
      const Parameter& p = trial.parameter(k);
      if (p.by_law && trial.law) expected_.push_back({k, p.get(*trial.law) / p.step});
    }
    set_num_residuals(static_cast<int>(comparison.training().size() + expected_.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(trial.size()));
  }

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    if (!go_to(Eigen::Map<const Eigen::VectorXd>(parameters[0], trial_.size()))) return false;
    const std::vector<int>& training = comparison_.training();
    Eigen::Map<Eigen::VectorXd> rows(residuals, num_residuals());
    rows.head(training.size()) = residuals_(training);
    for (std::size_t e = 0; e < expected_.size(); ++e) {
      const auto [k, value] = expected_[e];
      rows[training.size() + e] = (x_[k] - value) / (kGainsSigma * value) * weight_;
    }
    if (!jacobians || !jacobians[0]) return true;
    correct_derivatives();
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Eigen::Map<RowMajor> derivatives(jacobians[0], rows.size(), x_.size());
    derivatives.topRows(training.size()) = trial_.jacobian(training, Eigen::all);
    derivatives.bottomRows(expected_.size()).setZero();
    for (std::size_t e = 0; e < expected_.size(); ++e) {
      const auto [k, value] = expected_[e];
      derivatives(training.size() + e, k) = weight_ / (kGainsSigma * value);
    }
    return true;
  }

 private:
  bool go_to(const Eigen::VectorXd& x) const {
    if (x == x_) return true;
    try {
      residuals_ = comparison_.residuals({trial_.with(x)}).col(0);
    } catch (const std::domain_error&) {
      return false;  // a robot without a finite motion
    } catch (const Stopped&) {
      return false;  // the next simulation throws it again, outside of Ceres
    }
    x_ = x;
    return true;
  }

  void correct_derivatives() const {
    if (x_ == trial_.x) return;
    const Eigen::VectorXd step = x_ - trial_.x;
    const Eigen::VectorXd missed = residuals_ - trial_.residuals - trial_.jacobian * step;
    trial_.jacobian += missed * step.transpose() / step.squaredNorm();
    trial_.residuals = residuals_;
    trial_.x = x_;
  }

  const Comparison& comparison_;
  Trial& trial_;
  std::vector<std::pair<std::size_t, double>> expected_;  // unknowns that the loops' law determines, and their values
  double weight_;                                         // of that
  // Ceres evaluates what it holds for a function of x alone; this only spares work.
  mutable Eigen::VectorXd x_, residuals_;
};

/// Measures residuals and derivatives at x: by differences, a simulation for each unknown.
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

/// Measures them where the candidate is.
void linearize(const Comparison& comparison, Trial& trial) {
  linearize(comparison, trial, trial.clamped(trial.unknowns(trial.candidate)));
}

/// Fits what is free, by derivatives of where it begins. Returns the unknowns.
Eigen::VectorXd minimize_once(const Comparison& comparison, Trial& trial) {
  Eigen::VectorXd x = trial.x;
  ceres::Problem least_squares;
  least_squares.AddResidualBlock(new TrainingCost(comparison, trial), nullptr, x.data());
  for (std::size_t k = 0; k < trial.free.size(); ++k) {
    least_squares.SetParameterLowerBound(x.data(), static_cast<int>(k), trial.min()[k]);
    least_squares.SetParameterUpperBound(x.data(), static_cast<int>(k), trial.max()[k]);
  }
  ceres::Solver::Options options;
  options.max_num_iterations = 8;
  options.function_tolerance = 1e-4;
  options.parameter_tolerance = 1e-4;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_line_search_step_size_iterations = 0;  // a step that fails shall be shorter, for one simulation
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &least_squares, &summary);
  return x;
}

/// Fits what is free, beginning with the derivatives that there are, until fresh ones find no better.
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

/// Covariance of the unknowns for residuals of variance 1, without the rows of the loops' law. Angles of wheels that
/// never turned leave no trace in the derivatives, and have none.
Eigen::MatrixXd covariance_of(const Comparison& comparison, const Trial& trial) {
  constexpr double kNoTrace = 1e-7;  // share of the largest singular value
  Eigen::JacobiSVD<Eigen::MatrixXd> svd;
  svd.setThreshold(kNoTrace);
  svd.compute(trial.jacobian(comparison.training(), Eigen::all), Eigen::ComputeThinV);
  const Eigen::VectorXd scales = svd.singularValues().head(svd.rank());
  const Eigen::MatrixXd root = svd.matrixV().leftCols(svd.rank()) * scales.cwiseInverse().asDiagonal();
  return root * root.transpose();
}

/// Sigma and correlation of what is free, from the scatter of residuals; those that follow each other count for fewer
/// as they are alike.
void estimate_errors(const Comparison& comparison, const Trial& trial, Fit& fit) {
  const Eigen::VectorXd& residuals = trial.residuals;
  double product = 0, predecessor_square = 0;
  for (std::size_t k = 0; k < comparison.predecessors().size(); ++k) {
    if (comparison.predecessors()[k] < 0) continue;
    product += residuals[k] * residuals[comparison.predecessors()[k]];
    predecessor_square += residuals[k] * residuals[k];
  }
  const double alike = std::clamp(predecessor_square > 0 ? product / predecessor_square : 0, 0.0, 0.95);
  const double square =
      std::max(residuals.squaredNorm() / static_cast<double>(residuals.size()), kMinScatter * kMinScatter);
  const std::vector<std::size_t>& free = trial.free;
  const Eigen::MatrixXd covariance =
      square * (1 + alike) / (1 - alike) * covariance_of(comparison, trial).topLeftCorner(free.size(), free.size());
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseSqrt();
  fit.fitted.assign(parameters().size(), false);
  for (const std::size_t number : free) fit.fitted[number] = true;
  fit.sigma.setZero(parameters().size());
  for (std::size_t k = 0; k < free.size(); ++k) fit.sigma[free[k]] = sigma[k] * trial.parameter(k).step;
  fit.correlation.setZero(parameters().size(), parameters().size());
  fit.correlation(free, free) = covariance.cwiseQuotient(sigma * sigma.transpose());
}

/// The step that puts an unknown back by `change` and adapts the others, to first order, to the rows that count, whose
/// J^T J is `normal`.
Eigen::VectorXd step_back(const Eigen::MatrixXd& normal, Eigen::Index fixed, double change) {
  Eigen::MatrixXd others = normal;
  others.row(fixed).setZero();
  others.col(fixed).setZero();
  others(fixed, fixed) = 1;
  Eigen::VectorXd push = -normal.col(fixed) * change;
  push[fixed] = change;
  return others.completeOrthogonalDecomposition().solve(push);
}

/// J^T J of the rows that are not held out, without those of the loops' law.
Eigen::MatrixXd normal_matrix(const Comparison& comparison, const Trial& trial) {
  Eigen::MatrixXd rows = trial.jacobian;
  for (const int row : comparison.held_out()) rows.row(row).setZero();
  return rows.transpose() * rows;
}

/// Puts parameters back to their start, one after the other, for as long as the held-out motions do not miss them: the
/// one that, to first order, they miss least, if the simulation confirms it.
void eliminate_insignificant_parameters(const Comparison& comparison, const Scene& start, Trial& trial, Fit& fit) {
  constexpr double kWorth = 1e-3;  // share of the error that a parameter must take away
  std::vector<bool> needed(parameters().size(), false);
  bool dropped = false;
  for (;;) {
    const Eigen::VectorXd x_start = trial.unknowns({start, trial.candidate.phi});
    const Eigen::MatrixXd normal = normal_matrix(comparison, trial);
    const double limit = (1 + kWorth) * comparison.held_out_error(trial.residuals);
    double min_error = limit;
    std::optional<std::size_t> best;
    Eigen::VectorXd there;
    for (std::size_t k = 0; k < trial.free.size(); ++k) {
      if (needed[trial.free[k]]) continue;
      const Eigen::VectorXd step = step_back(normal, static_cast<Eigen::Index>(k), x_start[k] - trial.x[k]);
      const double error = comparison.held_out_error(trial.residuals + trial.jacobian * step);
      if (error > min_error) continue;
      min_error = error;
      best = k;
      there = trial.clamped(trial.x + step);
    }
    if (!best) break;
    const Parameter& p = trial.parameter(*best);
    Candidate without = trial.with(there);
    const Eigen::VectorXd residuals = comparison.residuals({without}).col(0);
    if (comparison.held_out_error(residuals) > limit) {
      needed[trial.free[*best]] = true;
      continue;
    }
    fit.unidentifiable.push_back(
        fmt::format("{}: fitted, it does not lower the error on held-out motions; drive {}", p.name(), p.drive));
    p.set(without.scene, p.get(start));
    std::vector<Eigen::Index> others;
    for (Eigen::Index k = 0; k < there.size(); ++k) {
      if (k != static_cast<Eigen::Index>(*best)) others.push_back(k);
    }
    trial.free.erase(trial.free.begin() + static_cast<std::ptrdiff_t>(*best));
    trial.candidate = without;
    trial.x = there(others);
    trial.residuals = residuals;
    trial.jacobian = Eigen::MatrixXd(trial.jacobian(Eigen::all, others));
    dropped = true;
  }
  if (dropped) minimize(comparison, trial);
}

/// Finds whether the driver applies commands on arrival or in the cycles in which it reads the joints. In the latter
/// case the records' commands are delayed to those cycles.
bool find_cycles(std::vector<DriveRecord>& records, Candidate& candidate, const Workers& workers) {
  constexpr double kStep = 0.004;      // s
  constexpr double kNoWorse = 1.05;    // commands at one phase of the cycle cannot decide it
  constexpr double kHalfCycle = 0.01;  // s: the mean that waiting takes off the delay
  std::vector<DriveRecord> in_cycles;
  for (const DriveRecord& record : records) in_cycles.push_back(applied_in_cycles(record));
  Candidate waiting = candidate;
  const double first = candidate.scene.motors->command_delay - 3 * kStep;
  const double error = find_delay(candidate, records, workers, first, kStep);
  if (find_delay(waiting, in_cycles, workers, first - kHalfCycle, kStep) > kNoWorse * error) return false;
  candidate = waiting;
  records = in_cycles;
  return true;
}

}  // namespace

Fit fit(const Scene& start, std::vector<DriveRecord>& records, std::vector<std::string>& findings,
        const FitSettings& settings) {
  const Workers& workers = settings.workers;
  FirstGuess first = guess(start, records);
  bool pushed = false;
  for (DriveRecord& record : records) {
    for (const std::string& line : find_pushes(record, predict(first.scene, record))) {
      findings.push_back(line);
      pushed = true;
    }
  }
  if (pushed) first = guess(start, records);
  settings.progress(0.05);

  Trial trial;
  trial.candidate = {first.scene, std::vector<Wheels>(records.size(), Wheels::Zero())};
  for (std::size_t k = 0; k < parameters().size(); ++k) {
    if (first.identifiable[k]) trial.free.push_back(k);
  }
  if (first.gains_identified) trial.law = first.scene;
  find_angles(trial.candidate, records, workers);
  find_delay(trial.candidate, records, workers, 0, 0.02);
  settings.progress(0.1);
  Fit fit;
  fit.unidentifiable = first.unidentifiable;
  {
    const Comparison comparison(records, trial.candidate.scene.motors->command_delay, workers);
    if (comparison.held_out().empty()) {
      throw UnusableRecord(
          "fewer than three motions to fit to and to check with: drive the programme of identification_drive.launch");
    }
    linearize(comparison, trial);
    trial.candidate = trial.with(minimize_once(comparison, trial));
  }
  settings.progress(0.4);
  find_angles(trial.candidate, records, workers);  // by now the ripple is that of the robot
  if (find_cycles(records, trial.candidate, workers)) {
    findings.push_back("commands take effect in the cycles in which the driver publishes joint_states");
  }
  const Comparison comparison(records, trial.candidate.scene.motors->command_delay, workers);
  linearize(comparison, trial);
  minimize(comparison, trial);
  settings.progress(0.8);
  fit.error_before = comparison.held_out_error(comparison.residuals({{start, trial.candidate.phi}}).col(0));
  eliminate_insignificant_parameters(comparison, start, trial, fit);
  estimate_errors(comparison, trial, fit);
  fit.best = trial.candidate;
  fit.error_after = comparison.held_out_error(trial.residuals);
  settings.progress(1);
  return fit;
}

}  // namespace youbot_base_sim
