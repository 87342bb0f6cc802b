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

constexpr double kFilter = 0.3;      // s: the ripple of single rollers falls to a sixth
constexpr double kAngleStep = 0.05;  // rad
constexpr double kGainsWeight = 3;   // of the loops' law: residuals follow each other, so that hundreds count as one
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

/// All records beside a candidate, and how the differences change with the unknowns.
class Problem {
 public:
  Problem(const std::vector<DriveRecord>& records, double filter, int threads) : records_(records), threads_(threads) {
    for (const DriveRecord& record : records) {
      comparisons_.emplace_back(record, filter);
      const auto& held_out = comparisons_.back().held_out();
      const int offset = static_cast<int>(held_out_.size());
      held_out_.insert(held_out_.end(), held_out.begin(), held_out.end());
      for (const int before : comparisons_.back().predecessors())
        predecessors_.push_back(before < 0 ? -1 : before + offset);
    }
  }

  const std::vector<bool>& held_out() const { return held_out_; }
  const std::vector<int>& predecessors() const { return predecessors_; }

  Eigen::VectorXd residuals(const Scene& candidate, const std::vector<Wheels>& phi) const {
    Eigen::VectorXd all(static_cast<Eigen::Index>(held_out_.size()));
    Eigen::Index row = 0;
    for (std::size_t r = 0; r < records_.size(); ++r) {
      const Eigen::VectorXd part = comparisons_[r].residuals(predict(candidate, records_[r], phi[r]));
      all.segment(row, part.size()) = part;
      row += part.size();
    }
    return all;
  }

  /// Those of one record among the residuals of all.
  Eigen::VectorXd of_record(const Eigen::VectorXd& all, std::size_t record) const {
    Eigen::Index begin = 0;
    for (std::size_t r = 0; r < record; ++r) begin += static_cast<Eigen::Index>(comparisons_[r].held_out().size());
    return all.segment(begin, static_cast<Eigen::Index>(comparisons_[record].held_out().size()));
  }

  /// The residuals at each of several points, on all threads.
  std::vector<Eigen::VectorXd> residuals(const Scene& base, const Unknowns& unknowns,
                                         const std::vector<std::vector<double>>& points) const {
    std::vector<Eigen::VectorXd> results(points.size());
    std::atomic<std::size_t> next{0};
    const auto work = [&] {
      for (std::size_t k = next++; k < points.size(); k = next++) {
        Scene candidate = base;
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
  TrainingCost(const Problem& problem, const Scene& base, const Unknowns& unknowns, const std::vector<double>& min,
               const std::vector<double>& max, const Scene* law)
      : problem_(problem), base_(base), unknowns_(unknowns), min_(min), max_(max) {
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

  /// Rows of the motion, which come first.
  Eigen::Index num_rows() const { return static_cast<Eigen::Index>(rows_.size()); }

  bool Evaluate(const double* const* x, double* residuals, double** jacobians) const override {
    std::vector<std::vector<double>> points(1, {x[0], x[0] + unknowns_.size()});
    const bool derivatives = jacobians && jacobians[0];
    for (std::size_t k = 0; derivatives && k < unknowns_.size(); ++k) {
      for (const double side : {1.0, -1.0}) {
        points.push_back(points[0]);
        points.back()[k] = std::clamp(points[0][k] + side, min_[k], max_[k]);
      }
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
        const std::size_t up = 2 * k + 1, down = up + 1;
        jacobians[0][row * unknowns_.size() + k] =
            (results[up][rows_[row]] - results[down][rows_[row]]) / (points[up][k] - points[down][k]);
      }
    }
    for (std::size_t e = 0; e < expected_.size(); ++e) {
      const auto [k, value] = expected_[e];
      const std::size_t row = rows_.size() + e;
      residuals[row] = (x[0][k] - value) / (kGainsSigma * value) * kGainsWeight;
      if (!derivatives) continue;
      std::fill_n(jacobians[0] + row * unknowns_.size(), unknowns_.size(), 0.0);
      jacobians[0][row * unknowns_.size() + k] = kGainsWeight / (kGainsSigma * value);
    }
    return true;
  }

 private:
  const Problem& problem_;
  Scene base_;
  Unknowns unknowns_;
  std::vector<double> min_, max_;
  std::vector<Eigen::Index> rows_;
  std::vector<std::pair<std::size_t, double>> expected_;  // unknowns that the loops' law tells, and what it tells
};

/// A fit on its way.
struct Trial {
  Scene scene;
  std::vector<Wheels> phi;
  std::vector<bool> free;
  std::optional<Scene> law;   // whose gains follow from the loops' law
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
  std::vector<double> x = unknowns.values(trial.scene, trial.phi), min(x.size(), -HUGE_VAL), max(x.size(), HUGE_VAL);
  for (std::size_t k = 0; k < unknowns.free().size(); ++k) {
    const Parameter& p = parameters()[unknowns.free()[k]];
    min[k] = p.min / p.step;
    max[k] = p.max / p.step;
    x[k] = std::clamp(x[k], min[k], max[k]);
  }
  ceres::Problem least_squares;
  auto* cost = new TrainingCost(problem, trial.scene, unknowns, min, max,
                                trial.law ? &*trial.law : nullptr);  // belongs to least_squares
  least_squares.AddResidualBlock(cost, nullptr, x.data());
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (std::isfinite(min[k])) least_squares.SetParameterLowerBound(x.data(), static_cast<int>(k), min[k]);
    if (std::isfinite(max[k])) least_squares.SetParameterUpperBound(x.data(), static_cast<int>(k), max[k]);
  }
  ceres::Solver::Options options;
  options.max_num_iterations = iterations;
  options.function_tolerance = 1e-3;
  options.parameter_tolerance = 1e-4;
  options.linear_solver_type = ceres::DENSE_QR;
  options.line_search_interpolation_type = ceres::QUADRATIC;  // needs no derivatives, which are dear here
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &least_squares, &summary);

  unknowns.apply(x, trial.scene, trial.phi);
  std::vector<double> rows(static_cast<std::size_t>(cost->num_residuals()));
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> jacobian(cost->num_residuals(),
                                                                                  static_cast<Eigen::Index>(x.size()));
  const double* point = x.data();
  double* derivatives = jacobian.data();
  cost->Evaluate(&point, rows.data(), &derivatives);
  trial.jacobian = jacobian.topRows(cost->num_rows());  // without what the loops' law tells: sigma is the motion's own
  trial.residuals = robust(problem.residuals(trial.scene, trial.phi));
  trial.held_out_error = held_out_error(problem, trial.residuals);
}

/// Where the wheels stood: the angles at which ripples come when they came, one wheel after the other. To be found
/// before the rest, since least squares stay in the valley where they begin.
void find_angles(const std::vector<DriveRecord>& records, const Scene& scene, int threads, std::vector<Wheels>& phi) {
  constexpr double kRippleFilter = 0.04;  // s: lets the ripple through
  constexpr int kTried = 6, kRounds = 2;
  const double pitch = 2 * M_PI / scene.robot.rollers;
  const Problem problem(records, kRippleFilter, threads);
  const Unknowns unknowns(std::vector<bool>(parameters().size(), false), records.size());
  for (int wheel = 0; wheel < kRounds * kWheels; ++wheel) {
    // All records at once: each has its own best.
    std::vector<std::vector<Wheels>> tried(kTried, phi);
    std::vector<std::vector<double>> points;
    for (int k = 0; k < kTried; ++k) {
      for (Wheels& angles : tried[static_cast<std::size_t>(k)]) angles[wheel % kWheels] += k * pitch / kTried;
      points.push_back(unknowns.values(scene, tried[static_cast<std::size_t>(k)]));
    }
    const std::vector<Eigen::VectorXd> residuals = problem.residuals(scene, unknowns, points);
    for (std::size_t r = 0; r < records.size(); ++r) {
      std::size_t best = 0;
      std::vector<double> errors;
      for (const Eigen::VectorXd& all : residuals) errors.push_back(problem.of_record(all, r).squaredNorm());
      for (std::size_t k = 0; k < errors.size(); ++k) {
        if (errors[k] < errors[best]) best = k;
      }
      phi[r] = tried[best][r];
    }
  }
}

/// Sigma and correlation of what is free, from the scatter of residuals; those that follow each other count for fewer
/// as they are alike.
void estimate_errors(const Problem& problem, const Trial& trial, Fit& fit) {
  const auto n = static_cast<Eigen::Index>(parameters().size());
  fit.sigma.assign(parameters().size(), 0);
  fit.correlation.setZero(n, n);
  double square = 0, product = 0, predecessor_square = 0;
  for (std::size_t k = 0; k < problem.held_out().size(); ++k) {
    const double r = trial.residuals[static_cast<Eigen::Index>(k)];
    square += r * r;
    if (problem.predecessors()[k] < 0) continue;
    product += r * trial.residuals[problem.predecessors()[k]];
    predecessor_square += r * r;
  }
  const auto rows = static_cast<double>(problem.held_out().size());
  const double alike = std::clamp(predecessor_square > 0 ? product / predecessor_square : 0, 0.0, 0.95);
  const double variance = square / rows * (1 + alike) / (1 - alike);
  const Eigen::MatrixXd covariance =
      variance * (trial.jacobian.transpose() * trial.jacobian).completeOrthogonalDecomposition().pseudoInverse();
  const Unknowns unknowns(trial.free, trial.phi.size());
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

/// For each free parameter, the error on the held-out motions with it back at its start and the others adapted, to
/// first order.
std::vector<double> errors_without(const Problem& problem, const Trial& trial, const Scene& start) {
  const Unknowns unknowns(trial.free, trial.phi.size());
  const std::vector<double> x = unknowns.values(trial.scene, trial.phi), x_start = unknowns.values(start, trial.phi);
  const Eigen::MatrixXd normal = trial.jacobian.transpose() * trial.jacobian;
  std::vector<std::vector<double>> points;
  for (std::size_t k = 0; k < unknowns.free().size(); ++k) {
    const auto fixed = static_cast<Eigen::Index>(k);
    Eigen::MatrixXd others = normal;
    others.row(fixed).setZero();
    others.col(fixed).setZero();
    others(fixed, fixed) = 1;
    Eigen::VectorXd push = -normal.col(fixed) * (x_start[k] - x[k]);
    push[fixed] = x_start[k] - x[k];
    const Eigen::VectorXd step = others.ldlt().solve(push);
    points.push_back(x);
    for (std::size_t j = 0; j < x.size(); ++j) {
      double& value = points.back()[j];
      value += step[static_cast<Eigen::Index>(j)];
      if (j >= unknowns.free().size()) continue;
      const Parameter& p = parameters()[unknowns.free()[j]];
      value = std::clamp(value, p.min / p.step, p.max / p.step);
    }
  }
  std::vector<double> errors;
  for (const Eigen::VectorXd& r : problem.residuals(trial.scene, unknowns, points)) {
    errors.push_back(held_out_error(problem, robust(r)));
  }
  return errors;
}

/// Puts parameters back to their start, one after the other, for as long as the held-out motions do not miss them.
void drop_what_does_not_help(const Problem& problem, const Scene& start, Trial& trial, Fit& fit) {
  constexpr double kWorth = 1e-3;  // share of the error that a parameter must take away
  for (;;) {
    const Unknowns unknowns(trial.free, trial.phi.size());
    const std::vector<double> errors = errors_without(problem, trial, start);
    if (errors.empty()) return;
    const auto least = std::min_element(errors.begin(), errors.end());
    if (*least > (1 + kWorth) * trial.held_out_error) return;
    const std::size_t k = unknowns.free()[static_cast<std::size_t>(least - errors.begin())];
    const Parameter& p = parameters()[k];
    fit.untold.push_back(
        fmt::format("{}: fitted, it does not lower the error on held-out motions; drive {}", p.name(), p.drive));
    trial.free[k] = false;
    p.set(trial.scene, p.get(start));
    minimize(problem, trial, 6);
  }
}

}  // namespace

Fit fit(const Scene& start, std::vector<DriveRecord>& records, std::vector<std::string>& findings,
        const FitSettings& settings) {
  const int threads = std::max(1, settings.threads);
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

  const Problem problem(records, kFilter, threads);
  if (std::count(problem.held_out().begin(), problem.held_out().end(), true) == 0) {
    throw UnusableRecord(
        "fewer than three motions to fit to and to check with: drive the programme of "
        "identification_drive.launch");
  }
  Trial trial{first.scene, std::vector<Wheels>(records.size(), Wheels::Zero()), first.told, {}, {}, {}, 0};
  if (first.gains_told) trial.law = first.scene;
  find_angles(records, trial.scene, threads, trial.phi);
  progress(0.2);
  Fit fit;
  fit.untold = first.untold;
  fit.error_before = held_out_error(problem, robust(problem.residuals(start, trial.phi)));
  minimize(problem, trial, 6);
  progress(0.4);
  find_angles(records, trial.scene, threads, trial.phi);  // by now the ripple is that of the robot
  progress(0.5);
  minimize(problem, trial, 6);
  progress(0.8);
  drop_what_does_not_help(problem, start, trial, fit);
  estimate_errors(problem, trial, fit);
  fit.scene = trial.scene;
  fit.phi = trial.phi;
  fit.error_after = trial.held_out_error;
  fit.fitted = trial.free;
  progress(1);
  return fit;
}

}  // namespace youbot_base_sim
