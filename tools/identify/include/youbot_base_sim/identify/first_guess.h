#pragma once

#include <string>
#include <vector>

#include "youbot_base_sim/identify/drive_record.h"
#include "youbot_base_sim/identify/fitted_parameters.h"

namespace youbot_base_sim {

/// The result of linear least squares, from which the nonlinear fit starts.
struct FirstGuess {
  Scene scene;
  std::vector<bool> identifiable;  ///< for each of `parameters()`: whether the records determine it at all
  bool gains_identified = false;   ///< P and I follow from the loops' law, to kGainsSigma
  std::vector<std::string>
      unidentifiable;  ///< a line on each friction that they do not determine, and which drive would
};

/// P, I and delay from the loops' own law: torque against what the rate lacks, and against its integral, in each
/// motion. Friction by non-negative least squares on the means of torque where the rate has settled. A friction that
/// the others can stand for is refused: dry and viscous at one speed, drives and rollers in one direction.
constexpr double kGainsSigma = 0.02;  ///< share of P and I that the loops' law may be off: delays within a sample, hold

FirstGuess guess(const Scene& start, const std::vector<DriveRecord>& records);

}  // namespace youbot_base_sim
