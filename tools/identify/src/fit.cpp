#include "youbot_base_sim/identify/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "youbot_base_sim/identify/first_guess.h"
#include "youbot_base_sim/identify/least_squares.h"

namespace youbot_base_sim {

namespace {

constexpr double kInterval = 0.1;    // s, of the samples that are compared
constexpr double kWindow = 0.5;      // s, over which ground truth is compared
constexpr double kRate = 0.02;       // rad/s that rates may be off,
constexpr double kTorque = 0.02;     // N m, torques,
constexpr double kPose = 2e-3;       // m and rad, poses
constexpr double kJumping = 0.012;   // s: what a first guess of the delay may be off
constexpr double kAngleStep = 0.05;  // rad
constexpr double kGainsWeight = 3;   // of the loops' law: residuals follow each other, so that hundreds count as one
constexpr double kMinScatter = 0.1;  // of residuals, for sigma: less is luck, since readings are rounded to as much

/// For each sample, whether a command comes to act about then.
std::vector<bool> jumping(const DriveRecord& record, double delay) {
  std::vector<bool> jumping(record.t.size(), false);
  for (const double change : record.commands.t) {
    const auto first = std::lower_bound(record.t.begin(), record.t.end(), change + delay - kJumping);
    for (auto t = first; t != record.t.end() && *t <= change + delay + kJumping; ++t) {
      jumping[static_cast<std::size_t>(t - record.t.begin())] = true;
    }
  }
  return jumping;
}

/// The record as a prediction would have it.
Prediction recorded(const DriveRecord& record) {
  const Readings& readings = record;
  Prediction motion{readings, {}};
  if (record.truth_t.size() < 2) return motion;
  for (const double t : record.t) motion.pose.push_back(record.truth_at(t));
  return motion;
}

std::vector<std::size_t> compared_samples(const DriveRecord& record) {
  std::vector<std::size_t> samples;
  double next = 0;
  for (const std::size_t k : record.samples()) {
    if (record.t[k] < next) continue;
    samples.push_back(k);
    next = record.t[k] + kInterval;
  }
  return samples;
}

using Window = std::pair<std::size_t, std::size_t>;  // first and last samples

std::vector<Window> compared_windows(const DriveRecord& record) {
  std::vector<Window> windows;
  const auto is_measured = [&](double t) { return record.is_tracked(t) && !record.is_excluded(t); };
  for (std::size_t first = 0, last = 1; record.has_truth() && last < record.t.size(); ++last) {
    if (record.t[last] < record.t[first] + kWindow) continue;
    if (is_measured(record.t[first]) && is_measured(record.t[last])) windows.emplace_back(first, last);
    first = last;
  }
  return windows;
}

/// Records beside candidates: differences of low-passed modes of rates and torques, and of the displacement in each
/// half second. Each is a row, in units of the expected error, and robust: one that is far off counts linearly.
class Comparison {
 public:
  /// `delay`: of commands, s. Where one takes effect, torques jump: samples there are left out. `records` outlive this.
  Comparison(const std::vector<DriveRecord>& records, double delay, const Workers& workers)
      : records_(records), workers_(workers) {
    for (const DriveRecord& record : records) {
      Part part{jumping(record, delay), compared_samples(record), compared_windows(record), {}, {}};
      add_rows(record, part);
      part.recorded = values(record, part, recorded(record));
      parts_.push_back(std::move(part));
    }
  }

  /// The numbers of the rows that are fitted, and of those in every third motion, by which the fit is judged.
  const std::vector<int>& training() const { return training_; }
  const std::vector<int>& held_out() const { return held_out_; }
  /// For each row the one before it in time within one series; -1: none.
  const std::vector<int>& predecessors() const { return predecessors_; }

  /// Record less prediction, a column a candidate. Throws Stopped, and std::domain_error without a finite motion.
  Eigen::MatrixXd residuals(const std::vector<Candidate>& candidates) const {
    const std::vector<std::vector<Prediction>> predictions = predict(candidates, records_, workers_);
    Eigen::MatrixXd residuals(predecessors_.size(), candidates.size());
    for (std::size_t k = 0; k < candidates.size(); ++k) {
      Eigen::Index row = 0;
      for (std::size_t r = 0; r < records_.size(); ++r) {
        const Part& part = parts_[r];
        const Eigen::VectorXd off = part.recorded - values(records_[r], part, predictions[k][r]);
        const Eigen::Map<const Eigen::VectorXd> expected(part.expected.data(), off.size());
        residuals.col(k).segment(row, off.size()) = off.cwiseQuotient(expected).unaryExpr(&robust);
        row += off.size();
      }
    }
    return residuals;
  }

  /// The root mean square of those that are held out; 0 if none are.
  double held_out_error(const Eigen::VectorXd& residuals) const {
    return held_out_.empty() ? 0 : residuals(held_out_).norm() / std::sqrt(held_out_.size());
  }

 private:
  /// The part of one record that is compared.
  struct Part {
    std::vector<bool> jumping;         // torques, for each sample
    std::vector<std::size_t> samples;  // at which modes are compared
    std::vector<Window> windows;       // of ground truth
    std::vector<double> expected;      // that each row may be off
    Eigen::VectorXd recorded;          // values of all rows
  };

  void add_rows(const DriveRecord& record, Part& part) {
    const std::vector<Motion> motions = record.motions();
    const auto add = [&](double t, bool first, const std::vector<double>& expected) {
      const bool is_held_out = motion_at(motions, t).held_out;
      for (std::size_t k = 0; k < kModes * expected.size(); ++k) {
        const int row = static_cast<int>(predecessors_.size());
        (is_held_out ? held_out_ : training_).push_back(row);
        predecessors_.push_back(first ? -1 : row - static_cast<int>(kModes * expected.size()));
        part.expected.push_back(expected[k / kModes]);
      }
    };
    std::vector<double> of_sample = {kRate};
    if (record.has_torque()) of_sample.push_back(kTorque);
    for (const std::size_t k : part.samples) add(record.t[k], k == part.samples.front(), of_sample);
    for (const auto& window : part.windows) add(record.t[window.first], window == part.windows.front(), {kPose});
  }

  /// In the order of `add_rows`.
  static Eigen::VectorXd values(const DriveRecord& record, const Part& part, const Prediction& motion) {
    const auto rate = low_pass(record.t, modes_of(motion.dphi), kComparisonFilter);
    const auto torque = low_pass(record.t, modes_of(motion.torque), kComparisonFilter, part.jumping);
    Eigen::VectorXd all(part.expected.size());
    Eigen::Index row = 0;
    const auto add = [&](const Eigen::Vector3d& value) {
      all.segment<3>(row) = value;
      row += 3;
    };
    for (const std::size_t k : part.samples) {
      add(rate[k]);
      if (record.has_torque()) add(torque[k]);
    }
    for (const auto& [first, last] : part.windows) add(displacement(motion.pose[first], motion.pose[last]));
    return all;
  }

  const std::vector<DriveRecord>& records_;
  Workers workers_;
  std::vector<Part> parts_;
  std::vector<int> training_, held_out_, predecessors_;
};

/// A fit in progress. Unknowns are in units of their steps: the free parameters, then four angles for each record.
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
  /// The candidate's unknowns, within them.
  Eigen::VectorXd start() const { return clamped(unknowns(candidate)); }

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

/// Fits what is free to the training rows and the loops' law. Returns the unknowns. Derivatives are those of the trial,
/// corrected by what each step shows of them (Broyden's method), for a column costs a simulation.
Eigen::VectorXd minimize_once(const Comparison& comparison, Trial& trial) {
  // The better the records fit, the less the loops' law weighs, since they determine the gains themselves.
  const double scatter = std::sqrt(trial.residuals.squaredNorm() / static_cast<double>(trial.residuals.size()));
  const double weight = kGainsWeight * std::min(1.0, scatter);
  std::vector<std::pair<Eigen::Index, double>> expected;  // unknowns that the law determines, and their values
  for (std::size_t k = 0; k < trial.free.size(); ++k) {
    const Parameter& p = trial.parameter(k);
    if (p.by_law && trial.law) expected.emplace_back(k, p.get(*trial.law) / p.step);
  }
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
    if (jacobian) jacobian->setZero().topRows(trained) = trial.jacobian(training, Eigen::all);
    for (std::size_t e = 0; e < expected.size(); ++e) {
      const auto [k, value] = expected[e];
      const auto row = trained + static_cast<Eigen::Index>(e);
      rows[row] = (x[k] - value) / (kGainsSigma * value) * weight;
      if (jacobian) (*jacobian)(row, k) = weight / (kGainsSigma * value);
    }
  };
  const auto rows = trained + static_cast<Eigen::Index>(expected.size());
  return minimize_squares(evaluate, rows, trial.x, trial.min(), trial.max());
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

/// Sigma and correlation of what is free, from the residuals; alike successive ones count for fewer.
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
      square * (1 + alike) / (1 - alike) *
      unit_covariance(trial.jacobian(comparison.training(), Eigen::all)).topLeftCorner(free.size(), free.size());
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseSqrt();
  fit.fitted.assign(parameters().size(), false);
  fit.sigma.setZero(parameters().size());
  for (std::size_t k = 0; k < free.size(); ++k) {
    fit.fitted[free[k]] = true;
    fit.sigma[free[k]] = sigma[k] * trial.parameter(k).step;
  }
  fit.correlation.setZero(parameters().size(), parameters().size());
  fit.correlation(free, free) = covariance.cwiseQuotient(sigma * sigma.transpose());
}

/// Puts parameters back to their start while held-out motions do not miss them: by first order, then by simulation.
void eliminate_insignificant_parameters(const Comparison& comparison, const Scene& start, Trial& trial, Fit& fit) {
  constexpr double kWorth = 1e-3;  // share of the error that a parameter must take away
  std::vector<bool> needed(parameters().size(), false);
  bool dropped = false;
  for (;;) {
    const Eigen::VectorXd x_start = trial.unknowns({start, trial.candidate.phi});
    Eigen::MatrixXd training = trial.jacobian;
    for (const int row : comparison.held_out()) training.row(row).setZero();
    const Eigen::MatrixXd normal = normal_matrix(training);
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
    std::vector<std::size_t> others(trial.size());
    std::iota(others.begin(), others.end(), 0);
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(*best));
    trial.free.erase(trial.free.begin() + static_cast<std::ptrdiff_t>(*best));
    trial.candidate = without;
    trial.x = there(others);
    trial.residuals = residuals;
    trial.jacobian = Eigen::MatrixXd(trial.jacobian(Eigen::all, others));
    dropped = true;
  }
  if (dropped) minimize(comparison, trial);
}

/// True if the driver applies commands in the cycles in which it reads the joints: then delays the records' commands.
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
  const std::size_t found = findings.size();
  for (DriveRecord& record : records) {
    for (const std::string& line : find_pushes(record, predict(first.scene, record))) findings.push_back(line);
  }
  if (findings.size() > found) first = guess(start, records);
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
    linearize(comparison, trial, trial.start());
    trial.candidate = trial.with(minimize_once(comparison, trial));
  }
  settings.progress(0.4);
  if (find_cycles(records, trial.candidate, workers)) {
    findings.push_back("commands take effect in the cycles in which the driver publishes joint_states");
  }
  find_angles(trial.candidate, records, workers);  // by now the ripple is that of the robot, and commands are in time
  const Comparison comparison(records, trial.candidate.scene.motors->command_delay, workers);
  linearize(comparison, trial, trial.start());
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
