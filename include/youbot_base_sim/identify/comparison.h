#pragma once

#include <Eigen/Dense>
#include <vector>

#include "youbot_base_sim/identify/drive_record.h"
#include "youbot_base_sim/identify/forward_model.h"

namespace youbot_base_sim {

/// A record beside what a candidate does: differences of the low-passed modes of rates and torques, and of how far the
/// base came in each half second, where it was measured. Each in units of what one expects to be off, so that 1 is a
/// good fit.
class Comparison {
 public:
  /// `filter`: time constant of the low-pass filter, s; `delay`: about that of the commands, s. Where a command comes
  /// to act, torques jump, and a millisecond more decides which sample shows it: samples there are left out.
  Comparison(const DriveRecord& record, double filter, double delay);

  /// Differences, record less prediction.
  Eigen::VectorXd residuals(const Prediction& prediction) const;

  /// For each of them, whether it is held out: it lies in every third motion, by which the fit is judged.
  const std::vector<bool>& held_out() const { return held_out_; }

  /// Differences that follow each other in time within one series, as the number of each one's predecessor; -1: none.
  const std::vector<int>& predecessors() const { return predecessors_; }

 private:
  struct Window {
    std::size_t first, last;  // samples
    Eigen::Vector3d moved;    // by ground truth, in the frame of the base at first
  };

  void choose_samples();
  void choose_windows();

  const DriveRecord& record_;
  double filter_;
  std::vector<bool> jumping_;  // torques, for each sample
  std::vector<Eigen::Vector3d> rate_, torque_;
  std::vector<std::size_t> samples_;
  std::vector<Window> windows_;
  std::vector<bool> held_out_;
  std::vector<int> predecessors_;
};

}  // namespace youbot_base_sim
