#pragma once

#include <functional>

#include "slip_problem.h"

namespace youbot_base_sim {
namespace bench {

/// A way to integrate a scene, and the settings it is run with, from coarse to fine.
struct Contestant {
  std::string key;    ///< in the CSV and on the command line
  std::string title;  ///< in the tables
  std::string notes;  ///< how it is run, one sentence or two
  bool fixed_step;    ///< a setting is a step size, s; otherwise a relative tolerance
  bool explicit_;     ///< needs steps of some 1e-7 s, and so runs over a short span
  std::vector<double> settings;
  /// Integrates the scene up to the last of the row times (s, increasing from 0). Throws RunFailure.
  std::function<Run(const Scene&, double setting, const std::vector<double>& rows)> run;
};

std::vector<Contestant> contestants();

/// A solver tight enough to measure others against.
struct Yardstick {
  std::string title;
  std::function<Run(const Scene&, const std::vector<double>& rows)> run;
};

enum class Effort {
  kQuick,       ///< a quick look
  kComparison,  ///< enough to compare contestants at 1e-5 m; not checked by another
  kRecord
};

/// The one to measure with, then another to tell its error by.
std::vector<Yardstick> yardsticks(Effort effort);

/// "Boost 1.74, SUNDIALS 6.4.1" and the like.
std::string libraries();

}  // namespace bench
}  // namespace youbot_base_sim
