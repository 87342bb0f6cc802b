#include "youbot_base_sim/identify/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "youbot_base_sim/identify/first_guess.h"
#include "youbot_base_sim/identify/least_squares.h"

namespace youbot_base_sim {

namespace {

constexpr double kInterval = 0.1;   // s, of the samples that are compared
constexpr double kWindow = 0.5;     // s, over which ground truth is compared
constexpr double kRate = 0.02;      // rad/s that rates may be off,
constexpr double kTorque = 0.02;    // N m, torques,
constexpr double kPose = 2e-3;      // m and rad, poses
constexpr double kJumping = 0.012;  // s: what a first guess of the delay may be off
constexpr double kGainsWeight = 3;  // of the loops' law: residuals follow each other, so that hundreds count as one

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
  for (std::size_t first = 0, last = 1; record.has_truth() && last < record.t.size(); ++last) {
    if (record.t[last] < record.t[first] + kWindow) continue;
    if (record.is_tracked(record.t[first]) && record.is_tracked(record.t[last])) windows.emplace_back(first, last);
    first = last;
  }
  return windows;
}

/// Records beside candidates: differences of low-passed modes of rates and torques, and of the displacement in each
/// half second. Every third motion is held out.
class DriveComparison : public Comparison {
 public:
  /// `delay`: of commands, s. Where one takes effect, torques jump: samples there are left out. `records` outlive this.
  DriveComparison(const std::vector<DriveRecord>& records, double delay, const Workers& workers)
      : records_(records), workers_(workers) {
    for (const DriveRecord& record : records) {
      Part part{jumping(record, delay), compared_samples(record), compared_windows(record), {}, {}};
      add_rows(record, part);
      part.recorded = values(record, part, recorded(record));
      parts_.push_back(std::move(part));
    }
  }

  Eigen::MatrixXd residuals(const std::vector<Candidate>& candidates) const override {
    const std::vector<std::vector<Prediction>> predictions = predict(candidates, records_, workers_);
    Eigen::MatrixXd residuals(rows(), candidates.size());
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
        add_row(is_held_out, first ? -1 : rows() - static_cast<Eigen::Index>(kModes * expected.size()));
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
};

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

  Trial trial = trial_of(parameters(), {first.scene, std::vector<Wheels>(records.size(), Wheels::Zero())});
  for (std::size_t k = 0; k < parameters().size(); ++k) {
    const Parameter& p = parameters()[k];
    if (!first.identifiable[k]) continue;
    trial.free.push_back(k);
    if (!p.by_law || !first.gains_identified) continue;
    trial.expected[k] = p.get(first.scene) / p.step;
    trial.weight[k] = kGainsWeight / (kGainsSigma * std::max(1.0, trial.expected[k]));
  }
  find_angles(trial.candidate, records, workers);
  find_delay(trial.candidate, records, workers, 0, 0.02);
  settings.progress(0.1);
  Fit fit;
  fit.unidentifiable = first.unidentifiable;
  {
    const DriveComparison comparison(records, trial.candidate.scene.motors->command_delay, workers);
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
  const DriveComparison comparison(records, trial.candidate.scene.motors->command_delay, workers);
  linearize(comparison, trial, trial.start());
  minimize(comparison, trial);
  settings.progress(0.8);
  fit.error_before = comparison.held_out_error(comparison.residuals({{start, trial.candidate.phi}}).col(0));
  finish(comparison, start, trial, fit);
  settings.progress(1);
  return fit;
}

}  // namespace youbot_base_sim
