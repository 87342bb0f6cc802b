#pragma once

#include <Eigen/Dense>
#include <vector>

#include "youbot_base_sim/identify/drive_record.h"
#include "youbot_base_sim/identify/forward_model.h"

namespace youbot_base_sim {

/// Time constant of the low-pass filter through which modes are compared, s: the ripple of single rollers falls to a
/// sixth.
constexpr double kComparisonFilter = 0.3;

/// A record beside what a candidate does: differences of the low-passed modes of rates and torques, and of how far the
/// base came in each half second, where it was measured. Each in units of what one expects to be off, so that 1 is a
/// good fit.
class Comparison {
 public:
  /// What a difference is, besides its size.
  struct Row {
    bool held_out;    ///< it lies in every third motion, by which the fit is judged
    int predecessor;  ///< the row before it in time within one series; -1: none
  };

  /// `delay`: about that of the commands, s. Where a command comes to act, torques jump, and a millisecond more decides
  /// which sample shows it: samples there are left out.
  Comparison(const DriveRecord& record, double delay);

  /// Differences, record less prediction.
  Eigen::VectorXd residuals(const Prediction& prediction) const;

  const std::vector<Row>& rows() const { return rows_; }

 private:
  struct Window {
    std::size_t first, last;  // samples
    Eigen::Vector3d moved;    // by ground truth, in the frame of the base at first
  };

  void choose_samples();
  void choose_windows();

  const DriveRecord& record_;
  std::vector<bool> jumping_;  // torques, for each sample
  std::vector<Eigen::Vector3d> rate_, torque_;
  std::vector<std::size_t> samples_;
  std::vector<Window> windows_;
  std::vector<Row> rows_;
};

}  // namespace youbot_base_sim
