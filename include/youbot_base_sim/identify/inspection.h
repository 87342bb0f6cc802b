#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "youbot_base_sim/identify/drive_record.h"
#include "youbot_base_sim/identify/forward_model.h"

namespace youbot_base_sim {

/// Why nothing can be fitted to a record, in one line.
class UnusableRecord : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Finds what is unlike the conventions of DriveRecord, by what wheels must do: a rate is the change of an angle,
/// wheels follow their commands, and motors put work into turning wheels. Mends it where there is one way to: signs of
/// single wheels, motor rpm, A or mA in place of N m. Gaps are excluded. Returns a line on each finding. Throws
/// UnusableRecord.
std::vector<std::string> inspect(DriveRecord& record);

/// Finds stretches in which the base was pushed: under a command that stays, torques and rates leave those of
/// `predicted` together. Excludes them and returns a line on each.
std::vector<std::string> find_pushes(DriveRecord& record, const Prediction& predicted);

}  // namespace youbot_base_sim
