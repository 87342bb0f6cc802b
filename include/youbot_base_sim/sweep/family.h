#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "youbot_base_sim/scene/scene.h"
#include "youbot_base_sim/sweep/draws.h"
#include "youbot_base_sim/sweep/quantities.h"

namespace youbot_base_sim {

/// A key of the scene, and the values that it has in turn or by chance.
struct Axis {
  std::string key;
  std::vector<std::string> list;  ///< the values, as YAML; empty: they are numbers of `range`
  Distribution range;
  int count = 0;             ///< of equal steps, or ratios, through the range with both its ends; 0: drawn from it
  std::uint64_t number = 0;  ///< among those drawn; else in the grid, where axes that change together have the same

  bool is_drawn() const { return size() == 0; }
  std::uint64_t size() const;                ///< 0 of an axis that is drawn
  std::string value(std::uint64_t k) const;  ///< of an axis that is not drawn, 0 <= k < size
  std::string value_at(double share) const;  ///< of any axis; 0 < share < 1
  std::string text() const;                  ///< what it is, for people
};

/// Which motions are kept whole.
struct Trajectories {
  std::string format = "csv";  ///< or "bag"; also the suffix of their files
  int every = 1;               ///< runs 0, every, 2 every, ..
};

/// Many runs of one scene, as a family file describes them, checked: the values of each axis are such that the scene
/// may have them. Where values that depend on each other make a scene that may not be, that run is refused when its
/// turn comes.
///
/// Runs are numbered from 0. The axes that are not drawn make a grid, whose last axis changes fastest. At each of its
/// points there are `draws` runs.
struct Family {
  static constexpr double kMaxRuns = 1e9;

  std::string path;
  std::string text;  ///< of the family file
  SceneFile scene;
  std::vector<Axis> axes;  ///< in the order of their columns: those of the grid, then those drawn
  int draws = 1;
  bool latin_hypercube = false;
  int seed = 0;
  std::vector<Quantity> quantities;
  std::optional<Trajectories> trajectories;
  std::vector<std::string> tables;  ///< that its scenes read

  std::uint64_t runs() const;
  bool has_draws() const { return !axes.empty() && axes.back().is_drawn(); }
  /// What a run sets, an axis each.
  std::vector<SceneSetting> settings(std::uint64_t run) const;
  /// What the rows depend on, a line each: the program, the family file, its scene, their tables, each
  /// by a hash of its contents and its name. Throws SceneError where a table can no longer be read.
  std::vector<std::string> fingerprint() const;
};

/// Reads and checks a family file, the scene that it names, and the tables of that. Throws SceneError.
Family load_family(const std::string& path);

/// Throws SceneError where the scene has no drive.
void require_drive(const Scene& scene);

}  // namespace youbot_base_sim
