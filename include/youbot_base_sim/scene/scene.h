#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <variant>

#include "youbot_base_sim/drive/torque_profiles.h"
#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

enum class Model {
  kNoSlip,   ///< the paper's model 1
  kViscous,  ///< 2a
  kCoulomb   ///< 2b
};

/// Reads `no_slip`, `viscous` or `coulomb`. Throws SceneError.
Model model_from_name(const std::string& name);
const char* name_of(Model model);

struct SolverSettings {
  /// Chosen so that the paper's Cases 1 and 2 stay within 1e-5 m and 1e-5 rad of the exact motion over their 30 s.
  double relative_tolerance = 3e-7;
  double absolute_tolerance = 3e-10;  ///< SI units; 1e-3 of the relative one unless given
  double control_period = 0;          ///< s; > 0: the drive is sampled and held over this period; 0: continuous in time
  std::string method = "radau";       ///< of integration: one of method_names()
};

/// Wheel rates from a table, rad/s, tracked by the wheels' velocity loop.
struct VelocityTable {
  WheelTable table;
};

/// One simulation: what a scene file describes, checked and with its defaults filled in. SI units, radians.
struct Scene {
  Model model = Model::kCoulomb;
  double duration = 0;       ///< s
  double output_rate = 100;  ///< rows per second
  RobotParameters robot;
  FloorParameters floor;
  State initial;
  SolverSettings solver;
  /// Empty where the scene has no drive: its commands come from elsewhere.
  std::variant<std::monostate, ReferenceMotion, TorqueSegments, WheelTable, VelocityTable> drive;
};

/// What is wrong with a scene, in one line: the key, its value and what is allowed.
class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a command line or a parameter puts in place of what the file says; a negative number or an empty name keeps the
/// file's.
struct SceneOverrides {
  std::string model;
  double relative_tolerance = -1;
  double control_period = -1;
  std::string method;
};

/// Reads a scene file. Throws SceneError.
Scene load_scene(const std::string& path, const SceneOverrides& overrides = {});

/// The scene's torque as a function of time; null where its drive is none, or tracks velocities.
std::unique_ptr<TorqueProfile> make_torque_profile(const Scene& scene);

}  // namespace youbot_base_sim
