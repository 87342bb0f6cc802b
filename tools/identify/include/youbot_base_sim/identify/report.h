#pragma once

#include <string>
#include <vector>

#include "youbot_base_sim/identify/drive_record.h"
#include "youbot_base_sim/identify/encoder_fit.h"
#include "youbot_base_sim/identify/fit.h"

namespace youbot_base_sim {

/// The fit, for the terminal: values, sigma, strong correlations, unidentifiable parameters, errors.
std::string report(const Scene& start, const Fit& fit);

/// The report of a fit to encoders: errors without each parameter, clocks and angles of each record, too.
std::string report(const Scene& start, const std::vector<DriveRecord>& records, const EncoderFit& fit);

/// The scene `start_path` (empty: the profile `measured`) with what was fitted, each with its sigma in a comment. It
/// repeats the record's commands by a velocity table, to be written to the file `table`. Throws SceneError.
std::string fitted_scene(const std::string& start_path, const Fit& fit, const DriveRecord& record,
                         const std::string& table);

/// The scene of a fit to encoders. It repeats the record by a table of wheel angles.
std::string fitted_scene(const std::string& start_path, const EncoderFit& fit, const DriveRecord& record,
                         const std::string& table);

/// The record's wheel angles as CSV.
std::string angle_table(const DriveRecord& record);

/// The record's velocity table as CSV.
std::string command_table(const DriveRecord& record);

/// Modes of rates and torques of the first record, recorded and fitted, low-passed, and what was held out, as CSV.
std::string comparison_csv(const Fit& fit, const DriveRecord& record);

}  // namespace youbot_base_sim
