#include "youbot_base_sim/identify/fit.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <thread>

#include "youbot_base_sim/identify/comparison.h"
#include "youbot_base_sim/identify/first_guess.h"
#include "youbot_base_sim/identify/forward_model.h"
#include "youbot_base_sim/identify/inspection.h"

namespace youbot_base_sim {

namespace {

constexpr double kAngleStep = 0.05;  // rad
constexpr double kOutlier = 3;       // residuals beyond this count with their size, not its square

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

  std::vector<double> values(const Candidate& candidate, const std::vector<Wheels>& phi) const {
    std::vector<double> x;
    for (const std::size_t k : free_) x.push_back(parameters()[k].get(candidate) / parameters()[k].step);
    for (const Wheels& angles : phi) {
      for (int i = 0; i < kWheels; ++i) x.push_back(angles[i] / kAngleStep);
    }
    return x;
  }

  void apply(const std::vector<double>& x, Candidate& candidate, std::vector<Wheels>& phi) const {
    for (std::size_t k = 0; k < free_.size(); ++k) parameters()[free_[k]].set(candidate, x[k] * parameters()[free_[k]].step);
    for (std::size_t r = 0; r < records_; ++r) {
      for (int i = 0; i < kWheels; ++i) phi[r][i] = x[free_.size() + kWheels * r + static_cast<std::size_t>(i)] * kAngleStep;
    }
  }

 private:
  std::vector<std::size_t> free_;
  std::size_t records_;
};

/// All records beside a candidate, and how the differences change with the unknowns.
class Problem {
 public:
  Problem(const std::vector<DriveRecord>& records, const FitSettings& settings)
      : records_(records), threads_(std::max(1, settings.threads)) {
    for (const DriveRecord& record : records) {
      comparisons_.emplace_back(record);
      const auto& held_out = comparisons_.back().held_out();
      const int offset = static_cast<int>(held_out_.size());
      held_out_.insert(held_out_.end(), held_out.begin(), held_out.end());
      for (const int before : comparisons_.back().predecessors()) predecessors_.push_back(before < 0 ? -1 : before + offset);
    }
  }

  const std::vector<bool>& held_out() const { return held_out_; }
  const std::vector<int>& predecessors() const { return predecessors_; }

  Eigen::VectorXd residuals(const Candidate& candidate, const std::vector<Wheels>& phi) const {
    Eigen::VectorXd all(static_cast<Eigen::Index>(held_out_.size()));
    Eigen::Index row = 0;
    for (std::size_t r = 0; r < records_.size(); ++r) {
      const Eigen::VectorXd part = comparisons_[r].residuals(predict(candidate, records_[r], phi[r]));
      all.segment(row, part.size()) = part;
      row += part.size();
    }
    return all;
  }

  /// The residuals at each of several points, on all threads.
  std::vector<Eigen::VectorXd> residuals(const Candidate& base, const Unknowns& unknowns,
                                         const std::vector<std::vector<double>>& points) const {
    std::vector<Eigen::VectorXd> results(points.size());
    std::atomic<std::size_t> next{0};
    const auto work = [&] {
      for (std::size_t k = next++; k < points.size(); k = next++) {
        Candidate candidate = base;
        std::vector<Wheels> phi(records_.size());
        unknowns.apply(points[k], candidate, phi);
        results[k] = residuals(candidate, phi);
      }
    };
    std::vector<std::thread> helpers;
    for (int k = 1; k < threads_; ++k) helpers.emplace_back(work);
    work();
    for (std::thread& helper : helpers) helper.join();
    return results;
  }

 private:
  const std::vector<DriveRecord>& records_;
  std::vector<Comparison> comparisons_;
  std::vector<bool> held_out_;
  std::vector<int> predecessors_;
  int threads_;
};

/// A residual whose square is the robust cost: quadratic at first, linear beyond kOutlier.
double robust(double r) {
  const double s = r * r / (kOutlier * kOutlier);
  return std::copysign(kOutlier * std::sqrt(2 * (std::sqrt(1 + s) - 1)), r);
}

Eigen::VectorXd robust(const Eigen::VectorXd& r) {
  return r.unaryExpr([](double x) { return robust(x); });
}

/// Ceres' view of the problem: the rows that are not held out, and their differences by all unknowns at once.
class TrainingCost : public ceres::CostFunction {
 public:
  TrainingCost(const Problem& problem, const Candidate& base, const Unknowns& unknowns, const std::vector<double>& max)
      : problem_(problem), base_(base), unknowns_(unknowns), max_(max) {
    for (std::size_t k = 0; k < problem.held_out().size(); ++k) {
      if (!problem.held_out()[k]) rows_.push_back(static_cast<Eigen::Index>(k));
    }
    set_num_residuals(static_cast<int>(rows_.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(unknowns.size()));
  }

  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    std::vector<std::vector<double>> points(1, {x[0], x[0] + unknowns_.size()});
    const bool derivatives = jacobians && jacobians[0];
    for (std::size_t k = 0; derivatives && k < unknowns_.size(); ++k) {
      points.push_back(points[0]);
      points.back()[k] += step(points[0][k], k);
    }
    std::vector<Eigen::VectorXd> results;
    try {
      results = problem_.residuals(base_, unknowns_, points);
    } catch (const std::domain_error&) {
      return false;  // a robot without a finite motion
    }
    for (Eigen::VectorXd& r : results) r = robust(r);
    for (std::size_t row = 0; row < rows_.size(); ++row) {
      residuals[row] = results[0][rows_[row]];
      for (std::size_t k = 0; derivatives && k < unknowns_.size(); ++k) {
        jacobians[0][row * unknowns_.size() + k] =
            (results[k + 1][rows_[row]] - residuals[row]) / step(points[0][k], k);
      }
    }
    return true;
  }

 private:
  /// One unit, downwards at the upper bound.
  double step(double x, std::size_t k) const { return x + 1 > max_[k] ? -1 : 1; }

  const Problem& problem_;
  Candidate base_;
  Unknowns unknowns_;
  std::vector<double> max_;
  std::vector<Eigen::Index> rows_;
};

/// A fit on its way.
struct Trial {
  Candidate candidate;
  std::vector<Wheels> phi;
  std::vector<bool> free;
  Eigen::MatrixXd jacobian;   // of the rows that are not held out, by the unknowns
  Eigen::VectorXd residuals;  // robust ones of all rows
  double held_out_error = 0;
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

/// Fits what is free.
void minimize(const Problem& problem, Trial& trial, int iterations) {
  const Unknowns unknowns(trial.free, trial.phi.size());
  std::vector<double> x = unknowns.values(trial.candidate, trial.phi), min(x.size(), -HUGE_VAL), max(x.size(), HUGE_VAL);
  for (std::size_t k = 0; k < unknowns.free().size(); ++k) {
    const Parameter& p = parameters()[unknowns.free()[k]];
    min[k] = p.min / p.step;
    max[k] = p.max / p.step;
    x[k] = std::clamp(x[k], min[k], max[k]);
  }
  ceres::Problem least_squares;
  auto* cost = new TrainingCost(problem, trial.candidate, unknowns, max);  // belongs to least_squares
  least_squares.AddResidualBlock(cost, nullptr, x.data());
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (std::isfinite(min[k])) least_squares.SetParameterLowerBound(x.data(), static_cast<int>(k), min[k]);
    if (std::isfinite(max[k])) least_squares.SetParameterUpperBound(x.data(), static_cast<int>(k), max[k]);
  }
  ceres::Solver::Options options;
  options.max_num_iterations = iterations;
  options.function_tolerance = 1e-4;
  options.parameter_tolerance = 1e-4;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &least_squares, &summary);
  if (getenv("DBG")) fmt::print("{}\n", summary.BriefReport());

  unknowns.apply(x, trial.candidate, trial.phi);
  std::vector<double> rows(static_cast<std::size_t>(cost->num_residuals()));
  trial.jacobian.resize(cost->num_residuals(), static_cast<Eigen::Index>(x.size()));
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> jacobian(trial.jacobian.rows(), trial.jacobian.cols());
  const double* point = x.data();
  double* derivatives = jacobian.data();
  cost->Evaluate(&point, rows.data(), &derivatives);
  trial.jacobian = jacobian;
  trial.residuals = robust(problem.residuals(trial.candidate, trial.phi));
  trial.held_out_error = held_out_error(problem, trial.residuals);
}

}  // namespace

Fit fit(const Candidate& start, std::vector<DriveRecord>& records, std::vector<std::string>& findings,
        const FitSettings& settings) {
  FirstGuess first = guess(start, records);
  std::vector<Wheels> phi(records.size(), Wheels::Zero());
  bool pushed = false;
  for (DriveRecord& record : records) {
    for (const std::string& line : find_pushes(record, predict(first.candidate, record, Wheels::Zero()))) {
      findings.push_back(line);
      pushed = true;
    }
  }
  if (pushed) first = guess(start, records);
  const Problem problem(records, settings);
  Fit fit;
  fit.error_before = held_out_error(problem, robust(problem.residuals(start, phi)));
  Trial trial{first.candidate, phi, first.told, {}, {}, 0};
  minimize(problem, trial, 15);
  fit.candidate = trial.candidate;
  fit.phi = trial.phi;
  fit.error_after = trial.held_out_error;
  fit.fitted = trial.free;
  return fit;
}

}  // namespace youbot_base_sim
