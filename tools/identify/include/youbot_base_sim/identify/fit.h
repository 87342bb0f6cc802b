#pragma once

#include <functional>
#include <string>
#include <vector>

#include "youbot_base_sim/identify/drive_record.h"
#include "youbot_base_sim/identify/fitted_parameters.h"
#include "youbot_base_sim/identify/forward_model.h"
#include "youbot_base_sim/identify/trial.h"

namespace youbot_base_sim {

/// Time constant of the low-pass filter through which modes are compared, s: rollers' ripple falls to a sixth.
constexpr double kComparisonFilter = 0.3;

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
