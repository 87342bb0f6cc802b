#pragma once

#include <string>

#include "youbot_base_sim/identify/drive_record.h"

namespace youbot_base_sim {

/// Reads a drive from a CSV table, whose first line names its columns. Rows are in order of t (s); each has the cells of
/// a group of columns all filled in, or all empty where nothing was measured. Of each group a table has all columns or
/// none; others are ignored.
///
/// phi_fl, phi_fr, phi_bl, phi_br        angles of the wheels, rad, positive forward
/// dphi_fl ..., torque_fl ...            with phi: rates, rad/s, without which they are differences of phi; torques, N m
/// command_fl ...                        commanded rates, rad/s, each held until the next
/// x, y, psi                             pose of the base, m and rad, psi unwrapped
///
/// `name`: how messages call the drive. Throws UnusableRecord, with the line.
DriveRecord read_drive_table(const std::string& path, const std::string& name);

}  // namespace youbot_base_sim
