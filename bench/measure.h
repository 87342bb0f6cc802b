#pragma once

#include "contestants.h"

namespace youbot_base_sim {
namespace bench {

/// A scene of the benchmark.
struct Subject {
  std::string key;    ///< in the CSV and on the command line
  std::string title;  ///< in tables and diagrams
  Scene scene;
  std::string rows;  ///< file of test/data/reference with rows of an independent solver; empty: none
};

/// Largest differences between two runs over their rows.
struct Errors {
  double position = 0;     ///< m
  double heading = 0;      ///< rad
  double velocity = 0;     ///< of (V_X, V_Y), m/s
  double yaw_rate = 0;     ///< rad/s
  double wheel_rate = 0;   ///< rad/s
  double roller_rate = 0;  ///< rad/s
};

Errors difference(const std::vector<Numbers>& a, const std::vector<Numbers>& b);

/// What one contestant did on one scene with one setting.
struct Measurement {
  std::string subject, contestant;
  double setting = 0;
  double span = 0;      ///< simulated, s
  double run_time = 0;  ///< processor time, the least of `repeats`, s
  int repeats = 0;
  Errors errors;
  Counts counts;
  std::string failure;  ///< empty: none
};

/// Rows at 20 Hz from 0 to `span` (s).
std::vector<double> row_times(double span);

/// Motion to measure against, and how far others, as independent of it as can be, are from it.
struct Reference {
  std::string title;
  std::vector<double> times;
  std::vector<Numbers> rows;
  std::int64_t switches = 0;
  struct Check {
    std::string title;
    Errors errors;
    std::string failure;
  };
  std::vector<Check> checks;
};

/// Computes the reference of a subject. Throws RunFailure.
Reference make_reference(const Subject& subject, double span, Effort effort);

/// Runs one contestant once or, while that is quick, some times.
Measurement measure(const Subject& subject, const Reference& reference, const Contestant& contestant, double setting,
                    double span);

/// Least run time (s) in which a contestant came within `error` (m) in position: on the lower envelope of its points,
/// straight in the logarithms.
struct Reached {
  double run_time = -1;  ///< negative: never that accurate
  bool bound = false;    ///< its coarsest setting is more accurate already, so this is an upper bound
};
Reached time_within(const std::vector<Measurement>& measurements, const std::string& subject,
                    const std::string& contestant, double error);

}  // namespace bench
}  // namespace youbot_base_sim
