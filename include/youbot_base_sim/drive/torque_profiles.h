#pragma once

#include <Eigen/Dense>
#include <array>
#include <utility>
#include <vector>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/physics/parameters.h"
#include "youbot_base_sim/physics/state.h"
#include "youbot_base_sim/physics/torque_profile.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// constant + cos * cos(2 pi t / period) + sin * sin(2 pi t / period): one of V_X, V_Y (m/s) or Omega (rad/s).
struct Harmonic {
  double constant = 0;
  double cos = 0;
  double sin = 0;
};

/// A desired motion of the platform: each velocity is one harmonic of a common period.
struct ReferenceMotion {
  double period = 1;  ///< s
  Harmonic V_X, V_Y, Omega;

  /// (V_X, V_Y, Omega), m/s and rad/s, at time t (s); then its derivative.
  Eigen::Vector3d velocity(double t) const;
  Eigen::Vector3d acceleration(double t) const;
};

/// The paper's open-loop control (section 5.2): the torques under which model 1 performs the desired motion.
class ReferenceTorque : public TorqueProfile {
 public:
  ReferenceTorque(const RobotParameters& robot, const ReferenceMotion& motion);
  Wheels value(double t) const override;
  std::array<Wheels, 3> values(const std::array<double, 3>& t) const override;
  double max_step(double t) const override;

 private:
  Wheels at(double sine, double cosine) const;

  NoSlipModel model_;
  ReferenceMotion motion_;
  // Without dry friction the torques are quadratic in the velocities: they have no harmonics above the second.
  Wheels constant_, cos_, sin_, cos_2_, sin_2_;
};

/// A segment of a torque profile: constant + cos * cos(2 pi t / period) + sin * sin(2 pi t / period), N m, at time t.
struct TorqueSegment {
  double start = 0;  ///< s
  Wheels constant = Wheels::Zero();
  Wheels cos = Wheels::Zero();
  Wheels sin = Wheels::Zero();
  double period = 1;  ///< s
};

using TorqueSegments = std::vector<TorqueSegment>;

/// A list of segments. Each holds from its start to the start of the next; the torque is zero before the first.
class PiecewiseTorque : public TorqueProfile {
 public:
  /// Starts must increase.
  explicit PiecewiseTorque(TorqueSegments segments) : segments_(std::move(segments)) {}
  double begin_segment(double t) override;
  Wheels value(double t) const override;
  double max_step(double t) const override;

 private:
  TorqueSegments segments_;
  TorqueSegment segment_;
};

/// Rows of four numbers, one for each wheel. Each row holds from its time to that of the next; zero before the first.
struct WheelTable {
  std::vector<double> t;  ///< s, increasing
  std::vector<Wheels> values;

  /// The row that holds at `time`, s.
  Wheels at(double time) const;
  /// Time of the first row after `time`, s; infinity if there is none.
  double next(double time) const;
};

/// The torque of a table, N m; each row is a segment.
class TableTorque : public TorqueProfile {
 public:
  explicit TableTorque(WheelTable table) : table_(std::move(table)) {}
  double begin_segment(double t) override;
  Wheels value(double) const override { return segment_; }

 private:
  WheelTable table_;
  Wheels segment_ = Wheels::Zero();
};

}  // namespace youbot_base_sim
