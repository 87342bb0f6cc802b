#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "youbot_base_sim/drive/torque_profiles.h"

namespace youbot_base_sim {

/// A stretch of a record under one command, or one that changes little, s.
struct Motion {
  double begin, end;
  bool held;              ///< the command stays the same
  bool moving;            ///< the command is not zero
  bool held_out = false;  ///< kept from the fit, to judge it by: every third that moves, and the stop after it
};

/// Time in which the base settles after a jump of the command, s.
constexpr double kSettlingTime = 1.0;

/// Samples of the motors; wheels positive forward on all four.
struct Readings {
  std::vector<Wheels> phi;     ///< rad
  std::vector<Wheels> dphi;    ///< rad/s
  std::vector<Wheels> torque;  ///< N m; empty: the bag has no effort
};

/// One recorded drive: readings, commanded wheel rates, and the true pose where measured. Times in s from its start.
struct DriveRecord : Readings {
  std::string name;                       ///< for messages
  std::vector<double> t;                  ///< of the readings, increasing
  WheelTable commands;                    ///< rates, rad/s, as they arrived; each holds until the next
  std::vector<double> truth_t;            ///< increasing; empty: not measured
  std::vector<Eigen::Vector3d> truth;     ///< x, y (m), heading (rad, unwrapped) in a fixed frame
  double max_truth_step = HUGE_VAL;       ///< between samples of ground truth, s; a longer one is a gap
  bool rates_from_angles = false;         ///< no velocities were recorded
  std::vector<Eigen::Vector2d> excluded;  ///< begin and end of stretches that are not fitted: gaps, pushes

  bool has_torque() const { return !torque.empty(); }
  bool has_truth() const { return !truth.empty(); }
  double duration() const { return t.empty() ? 0 : t.back(); }

  /// True if ground truth was measured about `time`, which no excluded stretch covers.
  bool is_tracked(double time) const;

  /// True if an excluded stretch covers `time`.
  bool is_excluded(double time) const;

  /// The true pose at `time` (s), by linear interpolation.
  Eigen::Vector3d truth_at(double time) const;

  /// The numbers of the samples from `begin` to before `end` (s) that are not excluded.
  std::vector<std::size_t> samples(double begin = 0, double end = HUGE_VAL) const;

  /// The record, cut where the command jumps; stretches are at least one second long, and at most four unless held.
  std::vector<Motion> motions() const;
};

/// At `time` (s), linear between the instants t, which are two or more.
template <class Value>
Value interpolated(const std::vector<double>& t, const std::vector<Value>& values, double time) {
  const auto next = std::lower_bound(t.begin() + 1, t.end() - 1, time);
  const auto j = static_cast<std::size_t>(next - t.begin());
  const double share = (time - t[j - 1]) / (t[j] - t[j - 1]);
  return values[j - 1] + share * (values[j] - values[j - 1]);
}

/// 0 of none.
double median(std::vector<double> values);

/// Between instants, s: the median.
double usual_interval(const std::vector<double>& t);

/// From pose a to pose b (m, m, rad), in the frame of a.
Eigen::Vector3d displacement(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// The last of a record's motions that has begun at `time`.
const Motion& motion_at(const std::vector<Motion>& motions, double time);

constexpr int kModes = 3;
/// In columns of identify --csv: forward, lateral and yaw.
constexpr std::array<const char*, kModes> kModeNames = {"ahead", "sideways", "turning"};
/// In messages.
constexpr std::array<const char*, kModes> kDirections = {"forward", "lateral", "yaw"};

/// The parts of four wheels' rates or torques that drive the base forward, laterally and in yaw: means with each
/// wheel's sign there. What wheels do against each other depends on where every roller stood, and is left out.
Eigen::Vector3d modes(const Wheels& w);

/// The wheels' part in each mode.
Wheels wheels_of(const Eigen::Vector3d& m);

/// Motion components of samples, less those of `from` unless that is empty.
std::vector<Eigen::Vector3d> modes_of(const std::vector<Wheels>& samples, const std::vector<Wheels>& from = {});

/// Low-pass filter of first order for samples at times t (s). At those that are `left_out` it stays as it was.
template <class Value>
std::vector<Value> low_pass(const std::vector<double>& t, const std::vector<Value>& samples, double time_constant,
                            const std::vector<bool>& left_out = {}) {
  std::vector<Value> filtered(samples);
  for (std::size_t k = 1; k < samples.size(); ++k) {
    if (!left_out.empty() && left_out[k]) {
      filtered[k] = filtered[k - 1];
      continue;
    }
    const double keep = std::exp(-(t[k] - t[k - 1]) / time_constant);
    filtered[k] = keep * filtered[k - 1] + (1 - keep) * samples[k];
  }
  return filtered;
}

/// The reason why nothing can be fitted to a record, in one line.
struct UnusableRecord : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Finds what is unlike the conventions of DriveRecord, by what wheels must do: they follow their commands, and motors
/// put work into turning wheels. Mends it where there is one way to: signs of single wheels, A or mA in place of N m.
/// Gaps are excluded. Returns a line on each finding. Throws UnusableRecord.
std::vector<std::string> inspect(DriveRecord& record);

/// Inspects likewise a record of which only angles and ground truth count. Throws UnusableRecord.
std::vector<std::string> inspect_encoders(DriveRecord& record);

/// Excludes stretches of pushes: under a steady command, torques and rates leave `predicted`. Returns a line on each.
std::vector<std::string> find_pushes(DriveRecord& record, const Readings& predicted);

}  // namespace youbot_base_sim
