#pragma once

#include <Eigen/Dense>
#include <functional>
#include <string>
#include <vector>

#include "youbot_base_sim/identify/drive_record.h"
#include "youbot_base_sim/identify/fitted_parameters.h"
#include "youbot_base_sim/identify/forward_model.h"

namespace youbot_base_sim {

/// Time constant of the low-pass filter through which modes are compared, s: rollers' ripple falls to a sixth.
constexpr double kComparisonFilter = 0.3;

/// The result of a fit to records. Numbers are those of `parameters()`.
struct Fit {
  Candidate best;                           ///< the start with the fitted parameters
  std::vector<bool> fitted;                 ///< for each parameter; the others are the start's
  Eigen::VectorXd sigma;                    ///< one standard deviation of each; 0 where it was not fitted
  Eigen::MatrixXd correlation;              ///< zero where one was not fitted
  std::vector<std::string> unidentifiable;  ///< a line on each parameter that the records do not determine
  double error_before = 0;  ///< on the held-out motions, root mean square, 1: as good as can be expected
  double error_after = 0;
};

struct FitSettings {
  Workers workers;
  std::function<void(double share)> progress = [](double) {};  ///< called now and then with what is done, 0 to 1
};

/// Fits the identifiable parameters and the initial wheel angles, starting from `start`, by bounded robust least
/// squares on low-passed forward, lateral and yaw motions. A parameter is kept only if it lowers the error on held-out
/// motions. Records must be inspected. Throws UnusableRecord, and Stopped once settings.workers.stop is set.
Fit fit(const Scene& start, std::vector<DriveRecord>& records, std::vector<std::string>& findings,
        const FitSettings& settings = {});

}  // namespace youbot_base_sim
