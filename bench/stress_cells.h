#pragma once

#include <string>
#include <vector>

namespace youbot_base_sim {

/// One motion of the stress suite, as scene files, so that `simulate` can repeat it.
struct StressCell {
  std::string group;
  std::string name;   ///< unique within the group, fit for a file name
  std::string scene;  ///< YAML; a file that it names is NAME.csv beside it
  std::string table;  ///< CSV that the scene names; mostly empty
  bool quick;         ///< also part of the smoke test

  /// Name of its scene file without the ending.
  std::string file_name() const { return group + "_" + name; }
};

/// Group of the random runs, for which the accuracy of held wheels is looked at.
constexpr char kRandomGroup[] = "random";

/// The yardstick of run times: Case 1, counter-clockwise, model 2b. `longest` as below.
StressCell base_cell(double longest);

/// All of them, in the order in which they are run, groups together, each cut to `longest` (s of simulated time).
std::vector<StressCell> stress_cells(double longest);

}  // namespace youbot_base_sim
