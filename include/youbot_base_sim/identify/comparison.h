#pragma once

#include <Eigen/Dense>
#include <utility>
#include <vector>

#include "youbot_base_sim/identify/drive_record.h"
#include "youbot_base_sim/identify/forward_model.h"

namespace youbot_base_sim {

/// Time constant of the low-pass filter through which modes are compared, s: the ripple of single rollers falls to a
/// sixth.
constexpr double kComparisonFilter = 0.3;

/// Records beside what candidates do: differences of the low-passed modes of rates and torques, and of how far the base
/// came in each half second, where it was measured. Each is a row, in units of what one expects to be off, so that 1 is
/// a good fit, and robust: one that is far off counts linearly.
class Comparison {
 public:
  /// `delay`: about that of the commands, s. Where a command comes to act, torques jump, and a millisecond more decides
  /// which sample shows it: samples there are left out. `records` must outlive this.
  Comparison(const std::vector<DriveRecord>& records, double delay, const Workers& workers);

  /// The numbers of the rows that are fitted, and of those in every third motion, by which the fit is judged.
  const std::vector<int>& training() const { return training_; }
  const std::vector<int>& held_out() const { return held_out_; }
  /// For each row the one before it in time within one series; -1: none.
  const std::vector<int>& predecessors() const { return predecessors_; }

  /// Record less prediction in all rows, a column for each candidate. Throws Stopped, and std::domain_error for a robot
  /// without a finite motion.
  Eigen::MatrixXd residuals(const std::vector<Candidate>& candidates) const;

  /// The root mean square of those that are held out; 0 if none are.
  double held_out_error(const Eigen::VectorXd& residuals) const;

 private:
  /// What is compared of one record.
  struct Part {
    std::vector<bool> jumping;         // torques, for each sample
    std::vector<std::size_t> samples;  // at which modes are compared
    std::vector<std::pair<std::size_t, std::size_t>>
        windows;                   // the first and last samples of stretches of ground truth
    std::vector<double> expected;  // that each row may be off
    Eigen::VectorXd recorded;      // values of all rows
  };

  void add_rows(const DriveRecord& record, Part& part);
  static Eigen::VectorXd values(const DriveRecord& record, const Part& part, const Prediction& motion);

  const std::vector<DriveRecord>& records_;
  Workers workers_;
  std::vector<Part> parts_;
  std::vector<int> training_, held_out_, predecessors_;
};

}  // namespace youbot_base_sim
