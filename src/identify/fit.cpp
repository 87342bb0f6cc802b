#include "youbot_base_sim/identify/fit.h"

#include <ceres/cost_function.h>
#include <ceres/covariance.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "youbot_base_sim/identify/alignment.h"
#include "youbot_base_sim/identify/comparison.h"
#include "youbot_base_sim/identify/first_guess.h"
#include "youbot_base_sim/identify/forward_model.h"
#include "youbot_base_sim/identify/inspection.h"
#include "youbot_base_sim/identify/least_squares.h"
#include "youbot_base_sim/integration/motion_integrator.h"

namespace youbot_base_sim {

namespace {

constexpr double kFilter = 0.3;      // s: the ripple of single rollers falls to a sixth
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
  }

  std::size_t size() const { return free_.size() + kWheels * records_; }
  const std::vector<std::size_t>& free() const { return free_; }

  std::vector<double> values(const Scene& candidate, const std::vector<Wheels>& phi) const {
    std::vector<double> x;
    for (const std::size_t k : free_) x.push_back(parameters()[k].get(candidate) / parameters()[k].step);
    for (const Wheels& angles : phi) {
      for (int i = 0; i < kWheels; ++i) x.push_back(angles[i] / kAngleStep);
    }
    return x;
  }

  void apply(const std::vector<double>& x, Scene& candidate, std::vector<Wheels>& phi) const {
    for (std::size_t k = 0; k < free_.size(); ++k)
      parameters()[free_[k]].set(candidate, x[k] * parameters()[free_[k]].step);
    for (std::size_t r = 0; r < records_; ++r) {
      for (int i = 0; i < kWheels; ++i)
        phi[r][i] = x[free_.size() + kWheels * r + static_cast<std::size_t>(i)] * kAngleStep;
    }
  }

 private:
  std::vector<std::size_t> free_;
  std::size_t records_;
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
      comparisons_.emplace_back(record, kFilter, delay);
      const auto& held_out = comparisons_.back().held_out();
      const int offset = static_cast<int>(held_out_.size());
      held_out_.insert(held_out_.end(), held_out.begin(), held_out.end());
      for (const int before : comparisons_.back().predecessors())
        predecessors_.push_back(before < 0 ? -1 : before + offset);
    }
  }

  const std::vector<bool>& held_out() const { return held_out_; }
  const std::vector<int>& predecessors() const { return predecessors_; }

  /// Robust residuals of all rows, a column for each of several points.
  Eigen::MatrixXd residuals(const Scene& base, const Unknowns& unknowns,
                            const std::vector<std::vector<double>>& points) const {
    std::vector<Replay> replays;
    for (const std::vector<double>& point : points) {
      Scene candidate = base;
      std::vector<Wheels> phi(records_.size());
      unknowns.apply(point, candidate, phi);
      for (std::size_t r = 0; r < records_.size(); ++r) replays.push_back({candidate, &records_[r], phi[r]});
    }
    const std::vector<Prediction> predictions = predict(replays, workers_);
    Eigen::MatrixXd residuals(static_cast<Eigen::Index>(held_out_.size()), static_cast<Eigen::Index>(points.size()));
    Eigen::Index row = 0;
    for (std::size_t k = 0; k < replays.size(); ++k) {
      if (k % records_.size() == 0) row = 0;
      const Eigen::VectorXd part = comparisons_[k % records_.size()].residuals(predictions[k]);
      residuals.col(static_cast<Eigen::Index>(k / records_.size())).segment(row, part.size()) = part.unaryExpr(&robust);
      row += part.size();
    }
    return residuals;
  }

 private:
  const std::vector<DriveRecord>& records_;
  std::vector<Comparison> comparisons_;
  std::vector<bool> held_out_;
  std::vector<int> predecessors_;
  Workers workers_;
};

/// Residuals at a point, and their derivatives by the unknowns, of all rows.
struct Linearization {
  std::vector<double> x;
  Eigen::VectorXd residuals;
  Eigen::MatrixXd jacobian;
};

/// Bounds of the unknowns; angles have none.
struct Bounds {
  std::vector<double> min, max;

  explicit Bounds(const Unknowns& unknowns) : min(unknowns.size(), -HUGE_VAL), max(unknowns.size(), HUGE_VAL) {
    for (std::size_t k = 0; k < unknowns.free().size(); ++k) {
      const Parameter& p = parameters()[unknowns.free()[k]];
      min[k] = p.min / p.step;
      max[k] = p.max / p.step;
    }
  }

  void clamp(std::vector<double>& x) const {
    for (std::size_t k = 0; k < x.size(); ++k) x[k] = std::clamp(x[k], min[k], max[k]);
  }
};

/// By differences, a simulation for each unknown. Throws std::domain_error for a robot without a finite motion.
Linearization linearize(const Problem& problem, const Scene& base, const Unknowns& unknowns, const Bounds& bounds,
                        const std::vector<double>& x) {
  std::vector<std::vector<double>> points(x.size() + 1, x);
  for (std::size_t k = 0; k < x.size(); ++k) points[k][k] += x[k] + 1 <= bounds.max[k] ? 1 : -1;
  const Eigen::MatrixXd results = problem.residuals(base, unknowns, points);
  const auto n = static_cast<Eigen::Index>(x.size());
  Linearization at{x, results.col(n), results.leftCols(n)};
  for (std::size_t k = 0; k < x.size(); ++k) {
    auto column = at.jacobian.col(static_cast<Eigen::Index>(k));
    column = (column - at.residuals).eval() / (points[k][k] - x[k]);
  }
  return at;
}

/// Ceres' view of the problem: the rows that are not held out. Derivatives are measured once, and then corrected by
/// what each step shows of them (Broyden's method), for a column costs a simulation.
class TrainingCost : public ceres::CostFunction {
 public:
  TrainingCost(const Problem& problem, const Scene& base, const Unknowns& unknowns, Linearization at, const Scene* law)
      : problem_(problem), base_(base), unknowns_(unknowns), at_(std::move(at)), x_(at_.x), residuals_(at_.residuals) {
    // The better the records fit, the less the loops' law weighs, since they determine the gains themselves.
    const double scatter = std::sqrt(residuals_.squaredNorm() / static_cast<double>(residuals_.size()));
    weight_ = kGainsWeight * std::min(1.0, scatter);
    for (std::size_t k = 0; k < problem.held_out().size(); ++k) {
      if (!problem.held_out()[k]) rows_.push_back(static_cast<Eigen::Index>(k));
    }
    for (std::size_t k = 0; k < unknowns.free().size(); ++k) {
      const Parameter& p = parameters()[unknowns.free()[k]];
      if (p.by_law && law) expected_.push_back({k, p.get(*law) / p.step});
    }
    set_num_residuals(static_cast<int>(rows_.size() + expected_.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(unknowns.size()));
  }

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const std::vector<double> x(parameters[0], parameters[0] + unknowns_.size());
    if (!go_to(x)) return false;
    const bool derivatives = jacobians && jacobians[0];
    if (derivatives) correct_derivatives();
    for (std::size_t row = 0; row < rows_.size(); ++row) {
      residuals[row] = residuals_[rows_[row]];
      for (std::size_t k = 0; derivatives && k < x.size(); ++k) {
        jacobians[0][row * x.size() + k] = at_.jacobian(rows_[row], static_cast<Eigen::Index>(k));
      }
    }
    for (std::size_t e = 0; e < expected_.size(); ++e) {
      const auto [k, value] = expected_[e];
      const std::size_t row = rows_.size() + e;
      residuals[row] = (x[k] - value) / (kGainsSigma * value) * weight_;
      if (!derivatives) continue;
      std::fill_n(jacobians[0] + row * x.size(), x.size(), 0.0);
      jacobians[0][row * x.size() + k] = weight_ / (kGainsSigma * value);
    }
    return true;
  }

 private:
  bool go_to(const std::vector<double>& x) const {
    if (x == x_) return true;
    try {
      residuals_ = problem_.residuals(base_, unknowns_, {x}).col(0);
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
    const auto n = static_cast<Eigen::Index>(x_.size());
    const Eigen::VectorXd step =
        Eigen::Map<const Eigen::VectorXd>(x_.data(), n) - Eigen::Map<const Eigen::VectorXd>(at_.x.data(), n);
    const Eigen::VectorXd missed = residuals_ - at_.residuals - at_.jacobian * step;
    at_.jacobian += missed * step.transpose() / step.squaredNorm();
    at_.residuals = residuals_;
    at_.x = x_;
  }

  const Problem& problem_;
  Scene base_;
  Unknowns unknowns_;
  std::vector<Eigen::Index> rows_;
  std::vector<std::pair<std::size_t, double>> expected_;  // unknowns that the loops' law determines, and their values
  double weight_;                                         // of that
  // Ceres evaluates what it holds for a function of x alone; this only spares work.
  mutable Linearization at_;
  mutable std::vector<double> x_;
  mutable Eigen::VectorXd residuals_;
};

/// A fit in progress.
struct Trial {
  Scene scene;
  std::vector<Wheels> phi;
  std::vector<bool> free;
  std::optional<Scene> law;  // whose gains follow from the loops' law
  Linearization at;          // there
};

double held_out_error(const Problem& problem, const Eigen::VectorXd& residuals) {
  double sum = 0;
  int n = 0;
  for (std::size_t k = 0; k < problem.held_out().size(); ++k) {
    if (!problem.held_out()[k]) continue;
    const double r = residuals[static_cast<Eigen::Index>(k)];
    sum += r * r;
    ++n;
  }
  return n ? std::sqrt(sum / n) : 0;
}

double error_of_others(const Problem& problem, const Eigen::VectorXd& residuals) {
  const double held_out = held_out_error(problem, residuals);
  const auto n = std::count(problem.held_out().begin(), problem.held_out().end(), true);
  return std::sqrt(residuals.squaredNorm() - held_out * held_out * static_cast<double>(n));
}

/// Fits what is free, by derivatives of where it begins.
std::vector<double> minimize_once(const Problem& problem, const Trial& trial, const Unknowns& unknowns,
                                  const Bounds& bounds) {
  std::vector<double> x = trial.at.x;
  ceres::Problem least_squares;
  least_squares.AddResidualBlock(
      new TrainingCost(problem, trial.scene, unknowns, trial.at, trial.law ? &*trial.law : nullptr), nullptr, x.data());
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (std::isfinite(bounds.min[k])) {
      least_squares.SetParameterLowerBound(x.data(), static_cast<int>(k), bounds.min[k]);
    }
    if (std::isfinite(bounds.max[k])) {
      least_squares.SetParameterUpperBound(x.data(), static_cast<int>(k), bounds.max[k]);
    }
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

/// Measures derivatives where the trial is now.
void linearize(const Problem& problem, Trial& trial) {
  const Unknowns unknowns(trial.free, trial.phi.size());
  const Bounds bounds(unknowns);
  std::vector<double> x = unknowns.values(trial.scene, trial.phi);
  bounds.clamp(x);
  trial.at = linearize(problem, trial.scene, unknowns, bounds, x);
}

/// Fits what is free, nearly, by the derivatives that there are.
void minimize_roughly(const Problem& problem, Trial& trial) {
  const Unknowns unknowns(trial.free, trial.phi.size());
  trial.at.x = minimize_once(problem, trial, unknowns, Bounds(unknowns));
  unknowns.apply(trial.at.x, trial.scene, trial.phi);
}

/// Fits what is free, beginning with the derivatives that there are, until fresh ones find no better.
void minimize(const Problem& problem, Trial& trial) {
  constexpr int kTimes = 4;
  constexpr double kBetter = 0.995;
  const Unknowns unknowns(trial.free, trial.phi.size());
  const Bounds bounds(unknowns);
  for (int k = 0; k < kTimes; ++k) {
    const double before = error_of_others(problem, trial.at.residuals);
    const std::vector<double> x = minimize_once(problem, trial, unknowns, bounds);
    trial.at = linearize(problem, trial.scene, unknowns, bounds, x);
    if (error_of_others(problem, trial.at.residuals) > kBetter * before) break;
  }
  unknowns.apply(trial.at.x, trial.scene, trial.phi);
}

/// J^T J of the rows that are not held out, without the rows of the loops' law.
Eigen::MatrixXd normal_matrix(const Problem& problem, const Linearization& at) {
  Eigen::MatrixXd rows = at.jacobian;
  for (std::size_t k = 0; k < problem.held_out().size(); ++k) {
    if (problem.held_out()[k]) rows.row(static_cast<Eigen::Index>(k)).setZero();
  }
  return products_of_columns(rows);
}

Eigen::MatrixXd without_column(const Eigen::MatrixXd& matrix, Eigen::Index column) {
  Eigen::MatrixXd rest(matrix.rows(), matrix.cols() - 1);
  rest << matrix.leftCols(column), matrix.rightCols(rest.cols() - column);
  return rest;
}

/// Covariance of the unknowns for residuals of variance 1, without the rows of the loops' law. Throws
/// std::domain_error.
Eigen::MatrixXd covariance_of(const Problem& problem, const Trial& trial, const Unknowns& unknowns) {
  std::vector<double> x = trial.at.x;
  ceres::Problem rows;
  rows.AddResidualBlock(new TrainingCost(problem, trial.scene, unknowns, trial.at, nullptr), nullptr, x.data());
  ceres::Covariance::Options options;
  options.algorithm_type = ceres::DENSE_SVD;
  options.null_space_rank = -1;  // angles of wheels that never turned leave no trace
  ceres::Covariance covariance(options);
  Eigen::MatrixXd matrix(x.size(), x.size());
  if (!covariance.Compute(std::vector<std::pair<const double*, const double*>>{{x.data(), x.data()}}, &rows) ||
      !covariance.GetCovarianceBlock(x.data(), x.data(), matrix.data())) {
    throw std::domain_error("the covariance of what was fitted cannot be computed");
  }
  return matrix;
}

/// Sigma and correlation of what is free, from the scatter of residuals; those that follow each other count for fewer
/// as they are alike.
void estimate_errors(const Problem& problem, const Trial& trial, Fit& fit) {
  const auto n = static_cast<Eigen::Index>(parameters().size());
  fit.sigma.assign(parameters().size(), 0);
  fit.correlation.setZero(n, n);
  double square = 0, product = 0, predecessor_square = 0;
  for (std::size_t k = 0; k < problem.held_out().size(); ++k) {
    const double r = trial.at.residuals[static_cast<Eigen::Index>(k)];
    square += r * r;
    if (problem.predecessors()[k] < 0) continue;
    product += r * trial.at.residuals[problem.predecessors()[k]];
    predecessor_square += r * r;
  }
  const auto rows = static_cast<double>(problem.held_out().size());
  const double alike = std::clamp(predecessor_square > 0 ? product / predecessor_square : 0, 0.0, 0.95);
  const double variance = std::max(square / rows, kMinScatter * kMinScatter) * (1 + alike) / (1 - alike);
  const Unknowns unknowns(trial.free, trial.phi.size());
  const Eigen::MatrixXd covariance = variance * covariance_of(problem, trial, unknowns);
  const std::vector<std::size_t>& free = unknowns.free();
  for (std::size_t a = 0; a < free.size(); ++a) {
    const auto row = static_cast<Eigen::Index>(a);
    fit.sigma[free[a]] = std::sqrt(covariance(row, row)) * parameters()[free[a]].step;
    for (std::size_t b = 0; b < free.size(); ++b) {
      const auto column = static_cast<Eigen::Index>(b);
      fit.correlation(static_cast<Eigen::Index>(free[a]), static_cast<Eigen::Index>(free[b])) =
          covariance(row, column) / std::sqrt(covariance(row, row) * covariance(column, column));
    }
  }
}

/// The error on held-out motions of where the fit began, with the wheels where they stood.
double start_error(const Problem& problem, const Scene& start, const Trial& trial) {
  const Unknowns angles(std::vector<bool>(parameters().size(), false), trial.phi.size());
  return held_out_error(problem, problem.residuals(start, angles, {angles.values(start, trial.phi)}).col(0));
}

/// The step that puts an unknown back by `change` and adapts the others, to first order, to the rows that count.
Eigen::VectorXd step_back(const Eigen::MatrixXd& normal, Eigen::Index fixed, double change) {
  Eigen::MatrixXd others = normal;
  others.row(fixed).setZero();
  others.col(fixed).setZero();
  others(fixed, fixed) = 1;
  Eigen::VectorXd push = -normal.col(fixed) * change;
  push[fixed] = change;
  return least_squares(others, push);
}

/// Puts parameters back to their start, one after the other, for as long as the held-out motions do not miss them: the
/// one that, to first order, they miss least, if the simulation confirms it.
void eliminate_insignificant_parameters(const Problem& problem, const Scene& start, Trial& trial, Fit& fit) {
  constexpr double kWorth = 1e-3;  // share of the error that a parameter must take away
  std::vector<bool> needed(parameters().size(), false);
  bool dropped = false;
  for (;;) {
    const Unknowns unknowns(trial.free, trial.phi.size());
    const Bounds bounds(unknowns);
    const std::vector<double>& x = trial.at.x;
    const std::vector<double> x_start = unknowns.values(start, trial.phi);
    const Eigen::MatrixXd normal = normal_matrix(problem, trial.at);
    const double limit = (1 + kWorth) * held_out_error(problem, trial.at.residuals);
    double min_error = limit;
    std::size_t best = x.size();
    std::vector<double> there;
    for (std::size_t k = 0; k < unknowns.free().size(); ++k) {
      if (needed[unknowns.free()[k]]) continue;
      const Eigen::VectorXd step = step_back(normal, static_cast<Eigen::Index>(k), x_start[k] - x[k]);
      const double error = held_out_error(problem, trial.at.residuals + trial.at.jacobian * step);
      if (error > min_error) continue;
      min_error = error;
      best = k;
      there = x;
      for (std::size_t j = 0; j < x.size(); ++j) there[j] += step[static_cast<Eigen::Index>(j)];
      bounds.clamp(there);
    }
    if (best == x.size()) break;
    const std::size_t number = unknowns.free()[best];
    const Eigen::VectorXd residuals = problem.residuals(trial.scene, unknowns, {there}).col(0);
    if (held_out_error(problem, residuals) > limit) {
      needed[number] = true;
      continue;
    }
    const Parameter& p = parameters()[number];
    fit.unidentifiable.push_back(
        fmt::format("{}: fitted, it does not lower the error on held-out motions; drive {}", p.name(), p.drive));
    unknowns.apply(there, trial.scene, trial.phi);
    p.set(trial.scene, p.get(start));
    trial.free[number] = false;
    there.erase(there.begin() + static_cast<std::ptrdiff_t>(best));
    trial.at = {there, residuals, without_column(trial.at.jacobian, static_cast<Eigen::Index>(best))};
    dropped = true;
  }
  if (dropped) minimize(problem, trial);
}

/// Finds whether the driver applies commands on arrival or in the cycles in which it reads the joints. In the latter
/// case the records' commands are delayed to those cycles.
bool find_cycles(std::vector<DriveRecord>& records, Trial& trial, const Workers& workers) {
  constexpr double kStep = 0.004;      // s
  constexpr double kNoWorse = 1.05;    // commands at one phase of the cycle cannot decide it
  constexpr double kHalfCycle = 0.01;  // s: the mean that waiting takes off the delay
  std::vector<DriveRecord> in_cycles;
  for (const DriveRecord& record : records) in_cycles.push_back(applied_in_cycles(record));
  Scene waiting = trial.scene;
  const double first = trial.scene.motors->command_delay - 3 * kStep;
  const double error = find_delay(trial.scene, records, trial.phi, workers, first, kStep);
  if (find_delay(waiting, in_cycles, trial.phi, workers, first - kHalfCycle, kStep) > kNoWorse * error) return false;
  trial.scene = waiting;
  records = in_cycles;
  return true;
}

}  // namespace

Fit fit(const Scene& start, std::vector<DriveRecord>& records, std::vector<std::string>& findings,
        const FitSettings& settings) {
  const Workers& workers = settings.workers;
  const auto progress = [&](double share) {
    if (settings.progress) settings.progress(share);
  };
  FirstGuess first = guess(start, records);
  bool pushed = false;
  for (DriveRecord& record : records) {
    for (const std::string& line : find_pushes(record, predict(first.scene, record, Wheels::Zero()))) {
      findings.push_back(line);
      pushed = true;
    }
  }
  if (pushed) first = guess(start, records);
  progress(0.05);

  Trial trial{first.scene, std::vector<Wheels>(records.size(), Wheels::Zero()), first.identifiable, {}, {}};
  if (first.gains_identified) trial.law = first.scene;
  find_angles(trial.scene, records, workers, trial.phi);
  find_delay(trial.scene, records, trial.phi, workers, 0, 0.02);
  progress(0.1);
  Fit fit;
  fit.unidentifiable = first.unidentifiable;
  {
    const Problem problem(records, trial.scene.motors->command_delay, workers);
    if (std::count(problem.held_out().begin(), problem.held_out().end(), true) == 0) {
      throw UnusableRecord(
          "fewer than three motions to fit to and to check with: drive the programme of identification_drive.launch");
    }
    linearize(problem, trial);
    minimize_roughly(problem, trial);
  }
  progress(0.4);
  find_angles(trial.scene, records, workers, trial.phi);  // by now the ripple is that of the robot
  if (find_cycles(records, trial, workers)) {
    findings.push_back("commands are obeyed in the cycles in which the driver publishes joint_states");
  }
  const Problem problem(records, trial.scene.motors->command_delay, workers);
  linearize(problem, trial);
  minimize(problem, trial);
  progress(0.8);
  fit.error_before = start_error(problem, start, trial);
  eliminate_insignificant_parameters(problem, start, trial, fit);
  estimate_errors(problem, trial, fit);
  fit.scene = trial.scene;
  fit.phi = trial.phi;
  fit.error_after = held_out_error(problem, trial.at.residuals);
  fit.fitted = trial.free;
  progress(1);
  return fit;
}

}  // namespace youbot_base_sim
