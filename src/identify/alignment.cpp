#include "youbot_base_sim/identify/alignment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "youbot_base_sim/identify/forward_model.h"
#include "youbot_base_sim/identify/modes.h"
#include "youbot_base_sim/identify/motions.h"

namespace youbot_base_sim {

namespace {

constexpr double kMinRate = 0.5;        // rad/s: wheels that turn
constexpr double kTransient = 0.5;      // s, after which ripple is more than what is left of the start
constexpr double kRippleFilter = 0.15;  // s: what is slower is no ripple

using Ripple = std::array<std::complex<double>, kWheels>;

/// For each motion, the part of the wheels' rates that comes as often as their rollers, as amplitude and phase.
std::vector<Ripple> ripples(const DriveRecord& record, const std::vector<Wheels>& phi, const std::vector<Wheels>& dphi,
                            int rollers) {
  const std::vector<Wheels> slow = low_pass(record.t, dphi, kRippleFilter);
  std::vector<Ripple> ripples;
  for (const Motion& motion : motions(record)) {
    Ripple sum{};
    for (std::size_t k = 0; k < record.t.size(); ++k) {
      if (record.t[k] < motion.begin + kTransient || record.t[k] >= motion.end || record.is_excluded(record.t[k]))
        continue;
      for (int i = 0; i < kWheels; ++i) {
        if (std::abs(dphi[k][i]) < kMinRate) continue;
        sum[i] += (dphi[k][i] - slow[k][i]) * std::polar(1.0, -rollers * (phi[k][i] - phi[0][i]));
      }
    }
    ripples.push_back(sum);
  }
  return ripples;
}

double rate_error(const DriveRecord& record, const Prediction& prediction) {
  constexpr double kFilter = 0.1;  // s
  std::vector<Eigen::Vector3d> off;
  for (std::size_t k = 0; k < record.t.size(); ++k) off.push_back(modes(record.dphi[k] - prediction.dphi[k]));
  off = low_pass(record.t, off, kFilter);
  double error = 0;
  for (std::size_t k = 0; k < record.t.size(); ++k) {
    if (!record.is_excluded(record.t[k])) error += off[k].squaredNorm();
  }
  return error;
}

}  // namespace

void find_angles(const Scene& candidate, const std::vector<DriveRecord>& records, const Workers& workers,
                 std::vector<Wheels>& phi) {
  constexpr int kRounds = 6;  // every wheel's ripple shows in the others' rates too
  const int rollers = candidate.robot.rollers;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Replay> replays;
    for (std::size_t r = 0; r < records.size(); ++r) replays.push_back({candidate, &records[r], phi[r]});
    const std::vector<Prediction> predictions = predict(replays, workers);
    for (std::size_t r = 0; r < records.size(); ++r) {
      const std::vector<Ripple> recorded = ripples(records[r], records[r].phi, records[r].dphi, rollers);
      const std::vector<Ripple> predicted = ripples(records[r], predictions[r].phi, predictions[r].dphi, rollers);
      for (int i = 0; i < kWheels; ++i) {
        std::complex<double> apart = 0;
        for (std::size_t m = 0; m < recorded.size(); ++m) apart += recorded[m][i] * std::conj(predicted[m][i]);
        phi[r][i] += std::arg(apart) / rollers;
      }
    }
  }
}

DriveRecord applied_in_cycles(DriveRecord record) {
  const double longest = 2 * record.duration() / static_cast<double>(record.t.size());
  WheelTable commands;
  for (std::size_t k = 0; k < record.commands.t.size(); ++k) {
    const auto cycle = std::lower_bound(record.t.begin(), record.t.end(), record.commands.t[k]);
    if (cycle == record.t.end()) break;
    // The driver continued during a gap of the record.
    const double applied = *cycle - record.commands.t[k] < longest ? *cycle : record.commands.t[k];
    if (!commands.t.empty() && commands.t.back() == applied) {
      commands.values.back() = record.commands.values[k];
    } else {
      commands.t.push_back(applied);
      commands.values.push_back(record.commands.values[k]);
    }
  }
  record.commands = commands;
  return record;
}

double find_delay(Scene& candidate, const std::vector<DriveRecord>& records, const std::vector<Wheels>& phi,
                  const Workers& workers, double first, double step) {
  constexpr int kTried = 7;
  std::vector<Replay> replays;
  for (int k = 0; k < kTried; ++k) {
    Scene tried = candidate;
    tried.motors->command_delay = first + k * step;
    for (std::size_t r = 0; r < records.size(); ++r) replays.push_back({tried, &records[r], phi[r]});
  }
  const std::vector<Prediction> predictions = predict(replays, workers);
  std::array<double, kTried> errors{};
  for (std::size_t k = 0; k < replays.size(); ++k) {
    errors[k / records.size()] += rate_error(*replays[k].record, predictions[k]);
  }
  const auto best = std::min_element(errors.begin(), errors.end()) - errors.begin();
  const auto middle = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(best, 1, kTried - 2));
  const double before = errors[middle - 1], at = errors[middle], after = errors[middle + 1];
  const double curvature = before - 2 * at + after, slope = (after - before) / 2;
  const double offset = curvature > 0 ? std::clamp(-slope / curvature, -1.0, 1.0) : 0;
  candidate.motors->command_delay = std::max(0.0, first + (static_cast<double>(middle) + offset) * step);
  return at + offset * slope + offset * offset * curvature / 2;
}

}  // namespace youbot_base_sim
