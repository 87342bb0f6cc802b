#pragma once

#include <string>
#include <vector>

#include "stress_cells.h"
#include "stress_measure.h"

namespace youbot_base_sim {

/// How a requirement came out.
enum class Outcome { kHolds, kSensitive, kFails, kUnknown };

/// How a measurement compares with what is required. Each number is what was measured over what is allowed: holds up
/// to 1; not a number where it could not be measured.
struct Verdict {
  bool finished;            ///< and finite
  double cost;              ///< run time, over 20 times the base scene's
  double slice;             ///< slowest simulated millisecond, over 1 ms
  double held;              ///< error of a motion with a held wheel, over 1e-5 m; 0 where this does not count
  double energy;            ///< energy balance, over tolerance * energy
  double halving;           ///< change of the end pose, over tolerance * way
  Outcome halving_outcome;  ///< sensitive: the change is no more than the motion makes of the tolerance

  bool holds() const;
};

struct StressResult {
  const StressCell* cell;
  double tolerance;
  BaseCost base;
  Measurement measurement;
  Verdict verdict;
};

Verdict judge(const Measurement& m, double tolerance, const BaseCost& base);

/// One line for each cell and tolerance.
std::string csv(const std::vector<StressResult>& results);

/// What is required, and for each cell the worst over its tolerances.
std::string markdown(const std::vector<StressResult>& results);

}  // namespace youbot_base_sim
