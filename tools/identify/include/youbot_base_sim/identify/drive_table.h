#pragma once

#include <string>

#include "youbot_base_sim/identify/drive_record.h"

namespace youbot_base_sim {

/// Reads a drive from a CSV table, whose first line names its columns. Rows are in order of t (s). Columns come in
/// groups: phi_fl, phi_fr, phi_bl, phi_br, angles of the wheels, rad, positive forward; with them dphi_fl .., their
/// rates, rad/s, else differences of phi, and torque_fl .., N m; command_fl .., commanded rates, rad/s, each held until
/// the next; x, y and psi, the pose of the base, m and rad, psi unwrapped. A table has all columns of a group or none,
/// and a row all of a group's cells, or empty ones where nothing was measured. Other columns are ignored.
///
/// `name`: how messages call the drive. Throws UnusableRecord, with the line.
DriveRecord read_drive_table(const std::string& path, const std::string& name);

}  // namespace youbot_base_sim
