#pragma once

#include <string>
#include <vector>

#include "youbot_base_sim/identify/drive_record.h"
#include "youbot_base_sim/identify/fit.h"

namespace youbot_base_sim {

/// What was fitted, for the terminal: values, sigma, strong correlations, unidentifiable parameters, errors.
std::string report(const Scene& start, const Fit& fit);

/// The scene `start_path` (empty: the robot of profile `measured`) with what was fitted, each with its sigma in a
/// comment. It repeats the commands of the record by a velocity table that is to be written to the file `table`. Throws
/// SceneError.
std::string fitted_scene(const std::string& start_path, const Fit& fit, const DriveRecord& record,
                         const std::string& table);

/// That velocity table as CSV.
std::string command_table(const DriveRecord& record);

/// The modes of rates and torques as recorded in the first record that was fitted and as fitted, low-passed as they
/// were compared, as CSV for plots; and whether each sample was held out.
std::string comparison_csv(const Fit& fit, const DriveRecord& record);

}  // namespace youbot_base_sim
