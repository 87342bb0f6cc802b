#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/drive/prescribed_wheels.h"
#include "youbot_base_sim/drive/torque_profiles.h"
#include "youbot_base_sim/export.h"
#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/physics/model.h"
#include "youbot_base_sim/physics/parameters.h"
#include "youbot_base_sim/scene/load_schedule.h"
#include "youbot_base_sim/scene/scene_setting.h"
#include "youbot_base_sim/text/number.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// The model's name in a scene file.
const char* name_of(Model model);
/// The names that a scene may give as its model, and as its robot's profile.
std::vector<std::string> model_names();
std::vector<std::string> profile_names();

/// Settings of the integration; the absolute tolerance is 1e-3 of the relative one unless given.
struct SolverSettings : IntegrationSettings {
  double control_period = 0;  ///< s; > 0: the drive is sampled and held for this period; 0: continuous in time
};

/// Wheel rates from a table, rad/s, which the wheels' velocity loops track.
struct VelocityTable {
  WheelTable table;
};

/// One simulation as a scene file describes it, checked and with its defaults filled in. SI units, radians.
struct Scene {
  std::vector<std::string> files;  ///< its own and its table
  /// The scene as read, as YAML: with settings and defaults. Stale once the caller edits other members.
  std::string resolved;
  Model model = Model::kCoulomb;
  double duration = 0;       ///< s; 0 if it is left out
  double output_rate = 100;  ///< rows per second
  bool contacts_in_bags = false;
  RobotParameters robot;
  FloorParameters floor;
  LoadSchedule load_schedule;
  State initial;
  SolverSettings solver;
  /// Between commands and wheels. Empty: default motors for a velocity table; torques act directly.
  std::optional<MotorSettings> motors;
  /// Empty if commands come from elsewhere.
  std::variant<std::monostate, ReferenceMotion, TorqueSegments, WheelTable, VelocityTable,
               std::shared_ptr<const WheelMotion>>
      drive;
};

/// The range of control periods in which velocity loops of these gains are stable; empty if the scene's is.
std::string stable_period(const Scene& scene, const VelocityGains& gains);

/// True if a scene needs the extended equations rather than the paper's with other numbers.
bool beyond_the_paper(const Scene& scene);

/// Names a wheel that would leave the floor at rest under these loads and the scene's, at t (s) or later; empty if
/// none.
std::string lifted_wheel(const Scene& scene, const std::vector<Load>& more, double t);

// Ranges of the numbers that scene files and programs share.
inline constexpr Range kRelativeTolerances{1e-14, 0.1, ""};
inline constexpr Range kControlPeriods{1e-6, 10, "s", true};
inline constexpr Range kFrictionScales{0, 1e3, ""};
inline constexpr Range kPoses{-1e6, 1e6, "m or rad"};
inline constexpr Range kSpeeds{-1e4, 1e4, "m/s or rad/s"};
inline constexpr Range kWheelAngles{-1e6, 1e6, "rad"};

/// The text of a scene file.
struct SceneFile {
  std::string path;
  std::string text;
};

/// The use that a scene is read for.
enum class SceneUse {
  kRun,      ///< to run it: it must have a duration
  kCommands  ///< for a node: it has a control period, may have no duration, and its drive is ignored
};

/// Reads and checks a scene file and the tables that it names, with these settings. Throws SceneError.
Scene load_scene(const std::string& path, const SceneSettings& settings = {}, SceneUse use = SceneUse::kRun);

/// Reads a scene file and checks only that it is YAML. Throws SceneError.
SceneFile read_scene_file(const std::string& path);

/// Reads and checks the text of a scene file likewise. `resolved` stays empty unless asked for: that takes 0.25 ms.
Scene load_scene(const SceneFile& file, const SceneSettings& settings = {}, SceneUse use = SceneUse::kRun,
                 bool resolve = true);

/// The defaults with these settings, without a drive. Throws SceneError, which begins with the setting's key.
Scene default_scene(const SceneSettings& settings = {}, SceneUse use = SceneUse::kRun);

/// A scene file with these settings, as YAML. Throws SceneError for a key that leads nowhere.
std::string text_of(const SceneFile& file, const SceneSettings& settings);

/// 16 hexadecimal digits that differ between scenes, and between contents of their tables: a hash of `resolved`.
std::string id_of(const Scene& scene);

/// "# youbot_base_sim 1.0.0, scene 0123456789abcdef\n": what made an output.
std::string provenance(const Scene& scene);

/// All that is allowed but hardly meant, a line each: values of a likely wrong unit, rollers that no wheel has,
/// settings without effect, an explicit method that takes long.
std::vector<std::string> warnings_of(const Scene& scene);

/// The torque over time; null without a drive or for one of rates. That of a WheelMotion moves a
/// robot that PrescribedWheels has `driven`.
std::unique_ptr<TorqueProfile> make_torque_profile(const Scene& scene);

}  // namespace youbot_base_sim
