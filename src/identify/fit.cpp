#include "youbot_base_sim/identify/fit.h"

#include <ceres/cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "youbot_base_sim/identify/comparison.h"
#include "youbot_base_sim/identify/first_guess.h"
#include "youbot_base_sim/identify/inspection.h"
#include "youbot_base_sim/integration/motion_integrator.h"

namespace youbot_base_sim {

namespace {

constexpr double kAngleStep = 0.05;  // rad
constexpr double kGainsWeight = 3;   // of the loops' law: residuals follow each other, so that hundreds count as one
constexpr double kMinScatter = 0.1;  // of residuals, for sigma: less is luck, since readings are rounded to as much
constexpr double kOutlier = 3;       // residuals beyond it count linearly

/// What is unknown: numbers in units of their steps. First the free parameters, then four angles for each record.
class Unknowns {
 public:
  Unknowns(const std::vector<bool>& free, std::size_t records) : records_(records) {
    for (std::size_t k = 0; k < free.size(); ++k) {
      if (free[k]) free_.push_back(k);
    }
    min_.setConstant(size(), -HUGE_VAL);
    max_.setConstant(size(), HUGE_VAL);
    for (std::size_t k = 0; k < free_.size(); ++k) {
      const Parameter& p = parameters()[free_[k]];
      min_[k] = p.min / p.step;
      max_[k] = p.max / p.step;
    }
  }

  std::size_t size() const { return free_.size() + kWheels * records_; }
  const std::vector<std::size_t>& free() const { return free_; }  ///< the numbers of the free parameters

  /// Bounds; angles have none.
  const Eigen::VectorXd& min() const { return min_; }
  const Eigen::VectorXd& max() const { return max_; }
  Eigen::VectorXd clamped(const Eigen::VectorXd& x) const { return x.cwiseMax(min_).cwiseMin(max_); }

  Eigen::VectorXd values(const Candidate& candidate) const {
    Eigen::VectorXd x(size());
    for (std::size_t k = 0; k < free_.size(); ++k) {
      x[k] = parameters()[free_[k]].get(candidate.scene) / parameters()[free_[k]].step;
    }
    for (std::size_t r = 0; r < records_; ++r) x.segment<kWheels>(angles_of(r)) = candidate.phi[r] / kAngleStep;
    return x;
  }

  Candidate with(Candidate candidate, const Eigen::VectorXd& x) const {
    for (std::size_t k = 0; k < free_.size(); ++k) {
      parameters()[free_[k]].set(candidate.scene, x[k] * parameters()[free_[k]].step);
    }
    for (std::size_t r = 0; r < records_; ++r) candidate.phi[r] = x.segment<kWheels>(angles_of(r)) * kAngleStep;
    return candidate;
  }

 private:
  std::size_t angles_of(std::size_t record) const { return free_.size() + kWheels * record; }

  std::vector<std::size_t> free_;
  std::size_t records_;
  Eigen::VectorXd min_, max_;
};

/// A fit in progress.
struct Trial {
  Candidate candidate;
  std::vector<bool> free;
  std::optional<Scene> law;   // whose gains follow from the loops' law
  Eigen::VectorXd x;          // where derivatives were measured, or corrected to
  Eigen::VectorXd residuals;  // there, of all rows
  Eigen::MatrixXd jacobian;   // of these by the unknowns

  Unknowns unknowns() const { return {free, candidate.phi.size()}; }
};

/// A residual whose square is the robust cost: quadratic at first, linear beyond kOutlier. Ceres has it as
/// SoftLOneLoss, but applies a loss to a block as a whole, and one block has all rows, since one simulation yields
/// them.
double robust(double r) {
  const double s = r * r / (kOutlier * kOutlier);
  return std::copysign(kOutlier * std::sqrt(2 * (std::sqrt(1 + s) - 1)), r);
}

/// All records beside candidates.
class Problem {
 public:
  Problem(const std::vector<DriveRecord>& records, double delay, const Workers& workers)
      : records_(records), workers_(workers) {
    for (const DriveRecord& record : records) {
      const int offset = static_cast<int>(predecessors_.size());
      comparisons_.emplace_back(record, delay);
      for (const Comparison::Row& row : comparisons_.back().rows()) {
        (row.held_out ? held_out_ : training_).push_back(static_cast<int>(predecessors_.size()));
        predecessors_.push_back(row.predecessor < 0 ? -1 : row.predecessor + offset);
      }
    }
  }

  /// The numbers of the rows that are fitted, and of those by which the fit is judged.
  const std::vector<int>& training() const { return training_; }
  const std::vector<int>& held_out() const { return held_out_; }
  /// Of all rows.
  const std::vector<int>& predecessors() const { return predecessors_; }

  /// Robust residuals of all rows, a column for each candidate. Throws std::domain_error for a robot without a finite
  /// motion.
  Eigen::MatrixXd residuals(const std::vector<Candidate>& candidates) const {
    const std::vector<std::vector<Prediction>> predictions = predict(candidates, records_, workers_);
    Eigen::MatrixXd residuals(predecessors_.size(), candidates.size());
    for (std::size_t k = 0; k < candidates.size(); ++k) {
      Eigen::Index row = 0;
      for (std::size_t r = 0; r < records_.size(); ++r) {
        const Eigen::VectorXd part = comparisons_[r].residuals(predictions[k][r]);
        residuals.col(k).segment(row, part.size()) = part.unaryExpr(&robust);
        row += part.size();
      }
    }
    return residuals;
  }

  double held_out_error(const Eigen::VectorXd& residuals) const {
    return held_out_.empty() ? 0 : residuals(held_out_).norm() / std::sqrt(held_out_.size());
  }

 private:
  const std::vector<DriveRecord>& records_;
  std::vector<Comparison> comparisons_;
  std::vector<int> training_, held_out_, predecessors_;
  Workers workers_;
};

/// Ceres' view of the problem: the rows that are not held out. Derivatives are measured once, and then corrected by
/// what each step shows of them (Broyden's method), for a column costs a simulation.
class TrainingCost : public ceres::CostFunction {
 public:
  TrainingCost(const Problem& problem, const Trial& trial)
      : problem_(problem), unknowns_(trial.unknowns()), at_(trial), x_(at_.x), residuals_(at_.residuals) {
    // The better the records fit, the less the loops' law weighs, since they determine the gains themselves.
    const double scatter = std::sqrt(residuals_.squaredNorm() / static_cast<double>(residuals_.size()));
    weight_ = kGainsWeight * std::min(1.0, scatter);
    for (std::size_t k = 0; k < unknowns_.free().size(); ++k) {
      const Parameter& p = parameters()[unknowns_.free()[k]];
      if (p.by_law && trial.law) expected_.push_back({k, p.get(*trial.law) / p.step});
    }
    set_num_residuals(static_cast<int>(problem.training().size() + expected_.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(unknowns_.size()));
  }

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(parameters[0], unknowns_.size());
    if (!go_to(x)) return false;
    const std::vector<int>& training = problem_.training();
    Eigen::Map<Eigen::VectorXd> rows(residuals, num_residuals());
    rows.head(training.size()) = residuals_(training);
    for (std::size_t e = 0; e < expected_.size(); ++e) {
      const auto [k, value] = expected_[e];
      rows[training.size() + e] = (x[k] - value) / (kGainsSigma * value) * weight_;
    }
    if (!jacobians || !jacobians[0]) return true;
    correct_derivatives();
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Eigen::Map<RowMajor> derivatives(jacobians[0], rows.size(), x.size());
    derivatives.topRows(training.size()) = at_.jacobian(training, Eigen::all);
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
      residuals_ = problem_.residuals({unknowns_.with(at_.candidate, x)}).col(0);
    } catch (const std::domain_error&) {
      return false;  // a robot without a finite motion
    } catch (const Stopped&) {
      return false;  // the next simulation throws it again, outside of Ceres
    }
    x_ = x;
    return true;
  }

  void correct_derivatives() const {
    if (x_ == at_.x) return;
    const Eigen::VectorXd step = x_ - at_.x;
    const Eigen::VectorXd missed = residuals_ - at_.residuals - at_.jacobian * step;
    at_.jacobian += missed * step.transpose() / step.squaredNorm();
    at_.residuals = residuals_;
    at_.x = x_;
  }

  const Problem& problem_;
  Unknowns unknowns_;
  std::vector<std::pair<std::size_t, double>> expected_;  // unknowns that the loops' law determines, and their values
  double weight_;                                         // of that
  // Ceres evaluates what it holds for a function of x alone; this only spares work.
  mutable Trial at_;
  mutable Eigen::VectorXd x_, residuals_;
};

/// Measures residuals and derivatives at x: by differences, a simulation for each unknown.
void linearize(const Problem& problem, Trial& trial, const Eigen::VectorXd& x) {
  const Unknowns unknowns = trial.unknowns();
  const Eigen::Index n = x.size();
  Eigen::RowVectorXd steps(n);
  std::vector<Candidate> candidates;
  for (Eigen::Index k = 0; k < n; ++k) {
    Eigen::VectorXd there = x;
    there[k] += x[k] + 1 <= unknowns.max()[k] ? 1 : -1;
    steps[k] = there[k] - x[k];
    candidates.push_back(unknowns.with(trial.candidate, there));
  }
  candidates.push_back(unknowns.with(trial.candidate, x));
  const Eigen::MatrixXd results = problem.residuals(candidates);
  trial.x = x;
  trial.residuals = results.col(n);
  trial.jacobian = (results.leftCols(n).colwise() - trial.residuals).array().rowwise() / steps.array();
}

/// Measures them where the candidate is.
void linearize(const Problem& problem, Trial& trial) {
  const Unknowns unknowns = trial.unknowns();
  linearize(problem, trial, unknowns.clamped(unknowns.values(trial.candidate)));
}

/// Fits what is free, by derivatives of where it begins.
Eigen::VectorXd minimize_once(const Problem& problem, const Trial& trial) {
  Eigen::VectorXd x = trial.x;
  ceres::Problem least_squares;
  least_squares.AddResidualBlock(new TrainingCost(problem, trial), nullptr, x.data());
  const Unknowns unknowns = trial.unknowns();
  for (std::size_t k = 0; k < unknowns.free().size(); ++k) {
    least_squares.SetParameterLowerBound(x.data(), static_cast<int>(k), unknowns.min()[k]);
    least_squares.SetParameterUpperBound(x.data(), static_cast<int>(k), unknowns.max()[k]);
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
void minimize(const Problem& problem, Trial& trial) {
  constexpr int kTimes = 4;
  constexpr double kBetter = 0.995;
  for (int k = 0; k < kTimes; ++k) {
    const double before = trial.residuals(problem.training()).norm();
    linearize(problem, trial, minimize_once(problem, trial));
    if (trial.residuals(problem.training()).norm() > kBetter * before) break;
  }
  trial.candidate = trial.unknowns().with(trial.candidate, trial.x);
}

/// Covariance of the unknowns for residuals of variance 1, without the rows of the loops' law. Angles of wheels that
/// never turned leave no trace in the derivatives, and have none.
Eigen::MatrixXd covariance_of(const Problem& problem, const Trial& trial) {
  constexpr double kNoTrace = 1e-7;  // share of the largest singular value
  Eigen::JacobiSVD<Eigen::MatrixXd> svd;
  svd.setThreshold(kNoTrace);
  svd.compute(trial.jacobian(problem.training(), Eigen::all), Eigen::ComputeThinV);
  const Eigen::VectorXd scales = svd.singularValues().head(svd.rank());
  const Eigen::MatrixXd root = svd.matrixV().leftCols(svd.rank()) * scales.cwiseInverse().asDiagonal();
  return root * root.transpose();
}

/// Sigma and correlation of what is free, from the scatter of residuals; those that follow each other count for fewer
/// as they are alike.
void estimate_errors(const Problem& problem, const Trial& trial, Fit& fit) {
  const Eigen::VectorXd& residuals = trial.residuals;
  double product = 0, predecessor_square = 0;
  for (std::size_t k = 0; k < problem.predecessors().size(); ++k) {
    if (problem.predecessors()[k] < 0) continue;
    product += residuals[k] * residuals[problem.predecessors()[k]];
    predecessor_square += residuals[k] * residuals[k];
  }
  const double alike = std::clamp(predecessor_square > 0 ? product / predecessor_square : 0, 0.0, 0.95);
  const double square =
      std::max(residuals.squaredNorm() / static_cast<double>(residuals.size()), kMinScatter * kMinScatter);
  const std::vector<std::size_t> free = trial.unknowns().free();
  const Eigen::MatrixXd covariance =
      square * (1 + alike) / (1 - alike) * covariance_of(problem, trial).topLeftCorner(free.size(), free.size());
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseSqrt();
  fit.sigma.setZero(parameters().size());
  for (std::size_t k = 0; k < free.size(); ++k) fit.sigma[free[k]] = sigma[k] * parameters()[free[k]].step;
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
Eigen::MatrixXd normal_matrix(const Problem& problem, const Trial& trial) {
  Eigen::MatrixXd rows = trial.jacobian;
  for (const int row : problem.held_out()) rows.row(row).setZero();
  return rows.transpose() * rows;
}

/// Puts parameters back to their start, one after the other, for as long as the held-out motions do not miss them: the
/// one that, to first order, they miss least, if the simulation confirms it.
void eliminate_insignificant_parameters(const Problem& problem, const Scene& start, Trial& trial, Fit& fit) {
  constexpr double kWorth = 1e-3;  // share of the error that a parameter must take away
  std::vector<bool> needed(parameters().size(), false);
  bool dropped = false;
  for (;;) {
    const Unknowns unknowns = trial.unknowns();
    const Eigen::VectorXd x_start = unknowns.values({start, trial.candidate.phi});
    const Eigen::MatrixXd normal = normal_matrix(problem, trial);
    const double limit = (1 + kWorth) * problem.held_out_error(trial.residuals);
    double min_error = limit;
    std::optional<std::size_t> best;
    Eigen::VectorXd there;
    for (std::size_t k = 0; k < unknowns.free().size(); ++k) {
      if (needed[unknowns.free()[k]]) continue;
      const Eigen::VectorXd step = step_back(normal, static_cast<Eigen::Index>(k), x_start[k] - trial.x[k]);
      const double error = problem.held_out_error(trial.residuals + trial.jacobian * step);
      if (error > min_error) continue;
      min_error = error;
      best = k;
      there = unknowns.clamped(trial.x + step);
    }
    if (!best) break;
    const std::size_t number = unknowns.free()[*best];
    const Parameter& p = parameters()[number];
    Candidate without = unknowns.with(trial.candidate, there);
    const Eigen::VectorXd residuals = problem.residuals({without}).col(0);
    if (problem.held_out_error(residuals) > limit) {
      needed[number] = true;
      continue;
    }
    fit.unidentifiable.push_back(
        fmt::format("{}: fitted, it does not lower the error on held-out motions; drive {}", p.name(), p.drive));
    p.set(without.scene, p.get(start));
    std::vector<Eigen::Index> others;
    for (Eigen::Index k = 0; k < there.size(); ++k) {
      if (k != static_cast<Eigen::Index>(*best)) others.push_back(k);
    }
    trial.free[number] = false;
    trial.candidate = without;
    trial.x = there(others);
    trial.residuals = residuals;
    trial.jacobian = Eigen::MatrixXd(trial.jacobian(Eigen::all, others));
    dropped = true;
  }
  if (dropped) minimize(problem, trial);
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

  Trial trial{{first.scene, std::vector<Wheels>(records.size(), Wheels::Zero())}, first.identifiable, {}, {}, {}, {}};
  if (first.gains_identified) trial.law = first.scene;
  find_angles(trial.candidate, records, workers);
  find_delay(trial.candidate, records, workers, 0, 0.02);
  settings.progress(0.1);
  Fit fit;
  fit.unidentifiable = first.unidentifiable;
  {
    const Problem problem(records, trial.candidate.scene.motors->command_delay, workers);
    if (problem.held_out().empty()) {
      throw UnusableRecord(
          "fewer than three motions to fit to and to check with: drive the programme of identification_drive.launch");
    }
    linearize(problem, trial);
    trial.candidate = trial.unknowns().with(trial.candidate, minimize_once(problem, trial));
  }
  settings.progress(0.4);
  find_angles(trial.candidate, records, workers);  // by now the ripple is that of the robot
  if (find_cycles(records, trial.candidate, workers)) {
    findings.push_back("commands are obeyed in the cycles in which the driver publishes joint_states");
  }
  const Problem problem(records, trial.candidate.scene.motors->command_delay, workers);
  linearize(problem, trial);
  minimize(problem, trial);
  settings.progress(0.8);
  fit.error_before = problem.held_out_error(problem.residuals({{start, trial.candidate.phi}}).col(0));
  eliminate_insignificant_parameters(problem, start, trial, fit);
  estimate_errors(problem, trial, fit);
  fit.best = trial.candidate;
  fit.error_after = problem.held_out_error(trial.residuals);
  fit.fitted = trial.free;
  settings.progress(1);
  return fit;
}

}  // namespace youbot_base_sim
