#pragma once

#include <string>
#include <vector>

#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/physics/torque_profile.h"

namespace youbot_base_sim {

/// constant + cos * cos(2 pi t / period) + sin * sin(2 pi t / period), for one of V_X, V_Y (m/s) or Omega (rad/s).
struct Harmonic {
  double constant = 0;
  double cos = 0;
  double sin = 0;
};

/// A desired motion of the platform, each velocity one harmonic of a common period (s).
struct ReferenceMotion {
  double period = 1;
  Harmonic V_X, V_Y, Omega;

  /// (V_X, V_Y, Omega) and its first and second derivatives at time t (s).
  Eigen::Vector3d velocity(double t) const;
  Eigen::Vector3d acceleration(double t) const;
  Eigen::Vector3d jerk(double t) const;
};

/// The paper's open loop control (section 5.2): the torques under which model 1 carries out the desired motion.
class ReferenceTorque : public TorqueProfile {
 public:
  ReferenceTorque(const RobotParameters& robot, const ReferenceMotion& motion);
  double begin_segment(double) override { return std::numeric_limits<double>::infinity(); }
  Wheels value(double t) const override;
  Wheels derivative(double t) const override;

 private:
  NoSlipModel model_;
  ReferenceMotion motion_;
  // Torques are quadratic in the motion: they have harmonics up to the second.
  Wheels constant_, cos_, sin_, cos_2_, sin_2_;
};

/// One segment of a torque profile, from `start` (s) on: constant + cos * cos(2 pi t / period) + sin * sin(...), N m,
/// with t counted from zero, not from the start.
struct TorqueSegment {
  double start = 0;
  Wheels constant = Wheels::Zero();
  Wheels cos = Wheels::Zero();
  Wheels sin = Wheels::Zero();
  double period = 1;
};

using TorqueSegments = std::vector<TorqueSegment>;

/// Torque in segments, each of which holds from its start to the next one's; zero before the first.
class PiecewiseTorque : public TorqueProfile {
 public:
  /// Starts must increase.
  explicit PiecewiseTorque(TorqueSegments segments) : segments_(std::move(segments)) {}
  double begin_segment(double t) override;
  Wheels value(double t) const override;
  Wheels derivative(double t) const override;

 private:
  TorqueSegments segments_;
  TorqueSegment segment_;
};

/// Rows of four numbers, one for each wheel, each held from its time to the next row's; zero before the first.
struct WheelTable {
  std::vector<double> t;  ///< s, increasing
  std::vector<Wheels> values;

  Wheels at(double time) const;
  /// First row time after `time`, s; infinity if none.
  double next(double time) const;
};

/// Torque from a table, N m.
class TableTorque : public TorqueProfile {
 public:
  explicit TableTorque(WheelTable table) : table_(std::move(table)) {}
  double begin_segment(double t) override;
  Wheels value(double) const override { return segment_; }
  Wheels derivative(double) const override { return Wheels::Zero(); }

 private:
  WheelTable table_;
  Wheels segment_ = Wheels::Zero();
};

}  // namespace youbot_base_sim
