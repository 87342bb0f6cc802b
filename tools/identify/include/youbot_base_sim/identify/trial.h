#pragma once

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "youbot_base_sim/identify/fitted_parameters.h"

// The least squares of both fits: to a drive under commands, and to encoders and poses.

namespace youbot_base_sim {

/// Relates ground truth to the instants of the encoders' clock. A fit begins at the same ones: the reader of bags finds
/// an offset of more than a tenth of a second.
struct ClockMap {
  double offset = 0;   ///< s, at the first reading
  double stretch = 0;  ///< s of ground truth for one of the encoders, less 1

  /// The encoders' instant of one of ground truth.
  double encoders(double truth) const { return (truth - offset) / (1 + stretch); }
};

/// A scene that may be that of the records.
struct Candidate {
  Scene scene;
  std::vector<Wheels> phi = {};       ///< where the wheels of each record stood at first, rad; empty: anywhere
  std::vector<ClockMap> clocks = {};  ///< of each record's ground truth; empty: the encoders'
};

/// Rows in which records differ from candidates, in units of the expected error, and robust: one that is far off counts
/// linearly. Some are held out from the fit, which is judged by them.
class Comparison {
 public:
  virtual ~Comparison() = default;

  /// A column a candidate. Throws Stopped, and std::domain_error without a finite motion.
  virtual Eigen::MatrixXd residuals(const std::vector<Candidate>& candidates) const = 0;

  /// The numbers of the rows that are fitted, and of the others.
  const std::vector<int>& training() const { return training_; }
  const std::vector<int>& held_out() const { return held_out_; }

  /// The root mean square of those that are held out; 0 if none are.
  double held_out_error(const Eigen::VectorXd& residuals) const;

  /// The variance of the residuals, times how many successive rows of a series count as one since they are alike.
  double variance(const Eigen::VectorXd& residuals) const;

 protected:
  Eigen::Index rows() const { return static_cast<Eigen::Index>(before_.size()); }
  Eigen::Index before(Eigen::Index row) const { return row < rows() ? before_[static_cast<std::size_t>(row)] : -1; }

  /// Adds a row; `before`: the number of the one before it in its series; -1: none.
  void add_row(bool held_out, Eigen::Index before);

 private:
  std::vector<int> training_, held_out_;
  std::vector<Eigen::Index> before_;
};

/// A fit in progress. Unknowns are in units of their steps: the free parameters; then of each record the offset and
/// stretch of its clock and four angles, unless candidates lack them.
struct Trial {
  const std::vector<Parameter>* table;
  Candidate candidate;
  std::vector<std::size_t> free;  ///< the numbers of the free parameters
  /// What is known beforehand of each parameter of the table, in its steps: a value, and the inverse of its sigma.
  Eigen::VectorXd expected, weight;
  Eigen::VectorXd x, residuals;  ///< the unknowns where derivatives were measured, or corrected to; all rows there
  Eigen::MatrixXd jacobian;      ///< of these by the unknowns

  const Parameter& parameter(std::size_t k) const { return (*table)[free[k]]; }
  std::size_t size() const { return free.size() + of_record() * records(); }

  /// The number of the first unknown of a record's clock, and of its angles.
  std::size_t clock_of(std::size_t record) const { return free.size() + of_record() * record; }
  std::size_t angles_of(std::size_t record) const { return clock_of(record) + (candidate.clocks.empty() ? 0 : 2); }

  /// Bounds; those of clocks and angles are infinite.
  Eigen::VectorXd min() const { return bounds(&Parameter::min, -HUGE_VAL); }
  Eigen::VectorXd max() const { return bounds(&Parameter::max, HUGE_VAL); }
  Eigen::VectorXd clamped(const Eigen::VectorXd& values) const { return values.cwiseMax(min()).cwiseMin(max()); }

  /// The unknowns as `other` has them, and the candidate with other unknowns.
  Eigen::VectorXd unknowns(const Candidate& other) const;
  Eigen::VectorXd start() const { return clamped(unknowns(candidate)); }
  Candidate with(const Eigen::VectorXd& values) const;

 private:
  std::size_t records() const { return std::max(candidate.phi.size(), candidate.clocks.size()); }
  std::size_t of_record() const { return (candidate.clocks.empty() ? 0 : 2) + (candidate.phi.empty() ? 0 : kWheels); }
  Eigen::VectorXd bounds(double Parameter::*bound, double of_others) const;
};

/// Where clocks and angles change by a unit of an unknown: s, s/s and rad.
constexpr double kOffsetStep = 2e-3, kStretchStep = 2e-4, kAngleStep = 0.05;

/// A trial of a candidate, of whose parameters nothing is known beforehand.
Trial trial_of(const std::vector<Parameter>& table, const Candidate& candidate);

/// Measures residuals and derivatives at x: by differences, a simulation for each unknown.
void linearize(const Comparison& comparison, Trial& trial, const Eigen::VectorXd& x);

/// Fits what is free to the training rows and to what is expected. Returns the unknowns. Derivatives are those of the
/// trial, corrected by what each step shows of them (Broyden's method), for a column costs a simulation.
Eigen::VectorXd minimize_once(const Comparison& comparison, Trial& trial);

/// Fits what is free, beginning with the derivatives that there are, until fresh ones find no better.
void minimize(const Comparison& comparison, Trial& trial);

/// The result of a fit to records.
struct Fit {
  /// A parameter that was fitted; the others are the start's.
  struct Number {
    const Parameter* parameter;
    double value, sigma;   ///< one standard deviation
    double error_without;  ///< held-out error with it at its start, to which the others adapt to first order
  };

  Candidate best;                           ///< the start with the fitted parameters
  std::vector<Number> numbers;              ///< that lower the held-out error
  Eigen::MatrixXd correlation;              ///< of their errors
  Eigen::VectorXd sigma;                    ///< of all unknowns of the trial before any was put back, in their steps
  std::vector<std::string> unidentifiable;  ///< a line on each of the others
  double error_before = 0;                  ///< of the start on held-out rows, root mean square; 1: as expected
  double error_after = 0;
};

/// Puts parameters of a minimized trial back to their start while held-out rows do not miss them. Sets the fit, but for
/// `error_before`: sigma is that with all parameters free, for one put back may be wrong.
void finish(const Comparison& comparison, const Scene& start, Trial& trial, Fit& fit);

}  // namespace youbot_base_sim
