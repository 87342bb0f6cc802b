#pragma once

#include <map>

#include "measure.h"

namespace youbot_base_sim {
namespace bench {

/// One curve of how cost grows: run times of one contestant against something of the scene.
struct Growth {
  std::string quantity;  ///< "control period, s"
  std::string contestant;
  double setting;  ///< of the contestant, the same throughout
  struct Point {
    std::string value;
    Measurement measurement;
  };
  std::vector<Point> points;
};

/// All that the benchmark found.
struct Results {
  std::vector<Subject> subjects;
  std::vector<Contestant> contestants;
  std::map<std::string, Reference> references;  ///< by subject
  std::vector<Measurement> measurements;
  std::vector<Growth> growth;
  bool quick = false;
};

constexpr double kUsefulError = 1e-5;  ///< m, at which contestants are compared
// A contestant's sweep ends after a run that takes longer; sooner once it is within kUsefulError.
constexpr double kLongRun = 6.0;     // s
constexpr double kLongEnough = 2.5;  // s

std::string csv(const Results& results);
std::string markdown(const Results& results);

/// The part of the report that answers who takes how long at kUsefulError, for the terminal.
std::string comparison(const Results& results);

}  // namespace bench
}  // namespace youbot_base_sim
