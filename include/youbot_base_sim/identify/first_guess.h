#pragma once

#include <string>
#include <vector>

#include "youbot_base_sim/identify/drive_record.h"
#include "youbot_base_sim/identify/parameters.h"

namespace youbot_base_sim {

/// What linear least squares tell at once, for the nonlinear fit to start from.
struct FirstGuess {
  Scene scene;
  std::vector<bool> told;           ///< for each of `parameters()`: whether the records can tell it at all
  bool gains_told = false;          ///< P and I follow from the loops' law, to kGainsSigma
  std::vector<std::string> untold;  ///< a line on each friction that they cannot tell, and which drive would
};

/// P, I and delay from the loops' own law: torque against what the rate lacks, and against its integral, in each
/// motion. Friction by non-negative least squares on the means of torque where the rate has settled. A friction that
/// the others can stand for is refused: dry and viscous at one speed, drives and rollers in one direction.
constexpr double kGainsSigma = 0.02;  ///< share of P and I that the loops' law may be off: delays within a sample, hold

FirstGuess guess(const Scene& start, const std::vector<DriveRecord>& records);

}  // namespace youbot_base_sim
