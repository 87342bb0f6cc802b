#pragma once

#include <Eigen/Dense>
#include <atomic>
#include <vector>

#include "youbot_base_sim/identify/drive_record.h"
#include "youbot_base_sim/identify/fitted_parameters.h"
#include "youbot_base_sim/physics/no_slip_model.h"

namespace youbot_base_sim {

/// What a candidate would have done, at the times of a record's samples.
struct Prediction {
  std::vector<Wheels> phi;            ///< rad, from where they started
  std::vector<Wheels> dphi;           ///< rad/s
  std::vector<Wheels> torque;         ///< of the motors, N m
  std::vector<Eigen::Vector3d> pose;  ///< x, y (m), heading (rad), from where it started
};

/// The velocity (m/s, rad/s) at which wheels roll that turn at these rates (rad/s), nearly where they work against each
/// other.
Eigen::Vector3d rolling_velocity(const NoSlipModel& model, const Wheels& rates);

/// Resources of simulations.
struct Workers {
  int threads = 2;
  const std::atomic<bool>* stop = nullptr;  ///< once it is set, simulations throw Stopped; null: nothing stops them
};

/// Simulates the candidate under the record's commands, its wheels at the angles `phi` (rad) at first. Smooth in all
/// parameters, the delay included: differences of predictions are derivatives.
Prediction predict(const Scene& candidate, const DriveRecord& record, const Wheels& phi,
                   const std::atomic<bool>* stop = nullptr);

/// What is to be predicted.
struct Replay {
  Scene candidate;
  const DriveRecord* record;
  Wheels phi;
};

/// The predictions of all replays. They do not depend on the number of threads.
std::vector<Prediction> predict(const std::vector<Replay>& replays, const Workers& workers);

}  // namespace youbot_base_sim
