#pragma once

#include <Eigen/Dense>
#include <atomic>
#include <vector>

#include "youbot_base_sim/identify/drive_record.h"
#include "youbot_base_sim/identify/trial.h"
#include "youbot_base_sim/threads/share.h"

namespace youbot_base_sim {

/// The motion of a candidate, at the times of a record's samples. Angles count from where they started.
struct Prediction : Readings {
  std::vector<Eigen::Vector3d> pose;  ///< x, y (m), heading (rad), from where it started
};

/// Resources of simulations.
struct Workers {
  int threads = 2;
  const std::atomic<bool>* stop = nullptr;  ///< once it is set, simulations throw Stopped; null: nothing stops them

  /// Calls work(0) .. work(n - 1), on all threads.
  template <class Work>
  void share(std::size_t n, const Work& work) const {
    std::atomic<bool> failed{false};
    youbot_base_sim::share(n, threads, failed, work, [] {});
  }
};

/// Simulates the scene under the record's commands, from wheel angles `phi` (rad). Smooth in all parameters and delay.
Prediction predict(const Scene& scene, const DriveRecord& record, const Wheels& phi = Wheels::Zero(),
                   const std::atomic<bool>* stop = nullptr);

/// For each candidate what it would have done in each record. It does not depend on the number of threads.
std::vector<std::vector<Prediction>> predict(const std::vector<Candidate>& candidates,
                                             const std::vector<DriveRecord>& records, const Workers& workers);

// Clocks and places of the records beside a candidate.

/// Sets the angles at which the candidate's wheels stood at first: where ripples come as the records' do, by linear
/// least squares over all wheels. They are known but for whole rollers, and only of wheels whose rates ripple.
void find_angles(Candidate& candidate, const std::vector<DriveRecord>& records, const Workers& workers);

/// Sets the candidate's command delay to what fits the wheels' rates best, by a parabola through the best of seven from
/// `first` on, `step` (s) apart, and its neighbours. Returns the remaining cost (dimensionless).
double find_delay(Candidate& candidate, const std::vector<DriveRecord>& records, const Workers& workers, double first,
                  double step);

/// The record with commands as a driver applies them that acts as it reads the joints: at the next sample.
DriveRecord applied_in_cycles(DriveRecord record);

}  // namespace youbot_base_sim
