#include "youbot_base_sim/identify/comparison.h"

#include <algorithm>
#include <cmath>

#include "youbot_base_sim/identify/modes.h"
#include "youbot_base_sim/identify/motions.h"

namespace youbot_base_sim {

namespace {

constexpr double kInterval = 0.1;   // s, of the samples that are compared
constexpr double kWindow = 0.5;     // s, over which ground truth is compared
constexpr double kRate = 0.02;      // rad/s that rates may be off,
constexpr double kTorque = 0.02;    // N m, torques,
constexpr double kPose = 2e-3;      // m and rad, poses
constexpr double kJumping = 0.012;  // s: what a first guess of the delay may be off

template <class Modes>
std::vector<Eigen::Vector3d> filtered(const std::vector<double>& t, const Modes& wheels, double time_constant,
                                      const std::vector<bool>& left_out = {}) {
  std::vector<Eigen::Vector3d> samples;
  for (const Wheels& w : wheels) samples.push_back(modes(w));
  return low_pass(t, samples, time_constant, left_out);
}

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

/// From pose a to pose b, in the frame of a.
Eigen::Vector3d moved(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d d = b - a;
  const double c = std::cos(a[2]), s = std::sin(a[2]);
  return {c * d[0] + s * d[1], -s * d[0] + c * d[1], d[2]};
}

Eigen::Vector3d truth_at(const DriveRecord& record, double t) {
  const auto next = std::lower_bound(record.truth_t.begin(), record.truth_t.end(), t);
  const auto k = std::clamp<std::ptrdiff_t>(next - record.truth_t.begin(), 1,
                                            static_cast<std::ptrdiff_t>(record.truth_t.size()) - 1);
  const auto j = static_cast<std::size_t>(k);
  const double share = (t - record.truth_t[j - 1]) / (record.truth_t[j] - record.truth_t[j - 1]);
  return record.truth[j - 1] + share * (record.truth[j] - record.truth[j - 1]);
}

}  // namespace

Comparison::Comparison(const DriveRecord& record, double filter, double delay)
    : record_(record),
      filter_(filter),
      jumping_(jumping(record, delay)),
      rate_(filtered(record.t, record.dphi, filter)),
      torque_(filtered(record.t, record.torque, filter, jumping_)) {
  choose_samples();
  choose_windows();
  // Which rows are held out, and how they follow each other, in the order of `residuals`.
  const std::vector<Motion> parts = motions(record);
  const auto is_held_out = [&](double t) {
    bool held_out = false;
    for (const Motion& motion : parts) {
      if (motion.begin <= t) held_out = motion.held_out;
    }
    return held_out;
  };
  const int per_sample = record.has_torque() ? 2 * kModes : kModes;
  const auto add = [&](double t, bool first, int rows) {
    const bool held_out = is_held_out(t);
    for (int r = 0; r < rows; ++r) {
      predecessors_.push_back(first ? -1 : static_cast<int>(held_out_.size()) - rows);
      held_out_.push_back(held_out);
    }
  };
  for (std::size_t k = 0; k < samples_.size(); ++k) add(record.t[samples_[k]], k == 0, per_sample);
  for (std::size_t k = 0; k < windows_.size(); ++k) add(record.t[windows_[k].first], k == 0, 3);
}

void Comparison::choose_samples() {
  double next = 0;
  for (std::size_t k = 0; k < record_.t.size(); ++k) {
    if (record_.t[k] < next || record_.is_excluded(record_.t[k])) continue;
    samples_.push_back(k);
    next = record_.t[k] + kInterval;
  }
}

void Comparison::choose_windows() {
  if (!record_.has_truth()) return;
  for (std::size_t first = 0, last = 1; last < record_.t.size(); ++last) {
    if (record_.t[last] < record_.t[first] + kWindow) continue;
    const double begin = record_.t[first], end = record_.t[last];
    if (begin >= record_.truth_t.front() && end <= record_.truth_t.back() && !record_.is_excluded(begin) &&
        !record_.is_excluded(end)) {
      windows_.push_back({first, last, moved(truth_at(record_, begin), truth_at(record_, end))});
    }
    first = last;
  }
}

Eigen::VectorXd Comparison::residuals(const Prediction& prediction) const {
  const std::vector<Eigen::Vector3d> rate = filtered(record_.t, prediction.dphi, filter_);
  const std::vector<Eigen::Vector3d> torque = filtered(record_.t, prediction.torque, filter_, jumping_);
  Eigen::VectorXd all(static_cast<Eigen::Index>(held_out_.size()));
  Eigen::Index row = 0;
  const auto add = [&](const Eigen::Vector3d& difference, double expected) {
    all.segment<3>(row) = difference / expected;
    row += 3;
  };
  for (const std::size_t k : samples_) {
    add(rate_[k] - rate[k], kRate);
    if (record_.has_torque()) add(torque_[k] - torque[k], kTorque);
  }
  for (const Window& w : windows_) add(w.moved - moved(prediction.pose[w.first], prediction.pose[w.last]), kPose);
  return all;
}

}  // namespace youbot_base_sim
