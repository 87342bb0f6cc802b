#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "youbot_base_sim/scene/scene.h"
#include "youbot_base_sim/sweep/draws.h"
#include "youbot_base_sim/sweep/quantities.h"

namespace youbot_base_sim {

/// A key of the scene with its values, listed, in equal steps or drawn.
struct Axis {
  std::string key;
  std::vector<std::string> list;  ///< the values, as YAML; empty: numbers of `range`
  Distribution range;
  int count = 0;             ///< of values in equal steps or ratios, with both ends of the range; 0: drawn
  std::uint64_t number = 0;  ///< among drawn axes, or in the grid, where axes that change together share it

  bool is_drawn() const { return size() == 0; }
  std::uint64_t size() const;                ///< 0 of an axis that is drawn
  std::string value(std::uint64_t k) const;  ///< of an axis that is not drawn, 0 <= k < size
  std::string value_at(double share) const;  ///< of any axis; 0 < share < 1
  std::string text() const;                  ///< a description
};

/// The way in which the draws of a point of the grid fill their space.
enum class Sampling { kIndependent, kLatinHypercube, kSobol };

/// The runs whose motions are written.
struct Trajectories {
  std::string format = "csv";  ///< or "bag"; also the suffix of their files
  int every = 1;               ///< runs 0, every, 2 every, ..
};

/// Many runs of one scene by a family file. Axes are checked one by one; a run refuses an invalid combination.
///
/// Runs count from 0. Axes that are not drawn make a grid, whose last axis changes fastest; a point has `draws` runs.
struct Family {
  static constexpr double kMaxRuns = 1e9;

  std::string path;
  std::string text;  ///< of the family file
  SceneFile scene;
  std::vector<Axis> axes;  ///< in the order of their columns: those of the grid, then those drawn
  int draws = 1;
  Sampling sampling = Sampling::kIndependent;
  int seed = 0;
  std::vector<Quantity> quantities;
  std::optional<Trajectories> trajectories;
  std::vector<std::string> tables;              ///< that its scenes read
  std::map<std::string, std::string> warnings;  ///< of its scenes, the last of those that begin with the same key

  std::uint64_t runs() const;
  bool has_draws() const { return !axes.empty() && axes.back().is_drawn(); }
  /// Settings of a run, an axis each. But with a Latin hypercube more `draws` leave the draws of a point as they are.
  SceneSettings settings(std::uint64_t run) const;
  /// A line with hash and name for all that rows depend on: program, family, scene, tables. Throws SceneError.
  std::vector<std::string> fingerprint() const;

 private:
  /// The quantile of a drawn axis's value in its distribution.
  double share_of(const Axis& axis, std::uint64_t run) const;
};

/// Reads and checks a family file, its scene and their tables. Throws SceneError.
Family load_family(const std::string& path);

/// The hash of a file's contents. Throws SceneError if it cannot be read.
std::string file_hash(const std::string& path);

/// Throws SceneError if the scene has no drive.
void require_drive(const Scene& scene);

}  // namespace youbot_base_sim
