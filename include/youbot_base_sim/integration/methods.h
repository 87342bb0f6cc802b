#pragma once

#include <memory>
#include <string>
#include <vector>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/integration/motion_integrator.h"
#include "youbot_base_sim/integration/tolerance.h"
#include "youbot_base_sim/physics/model.h"
#include "youbot_base_sim/physics/parameters.h"
#include "youbot_base_sim/physics/torque_profile.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

class SmoothStepper;
struct IntegrationStatistics;

/// A method that integrates models 2a and 2b.
struct Method {
  std::string name;         ///< of `solver: {method: NAME}`, `--method` and `~method`
  std::string description;  ///< what it is and when to use it, in a line
  bool is_explicit;         ///< takes short steps while wheels roll, see `advice`
  /// Makes the method, which counts in `statistics`. Null for Radau, a class for each model.
  std::unique_ptr<SmoothStepper> (*make)(const Tolerance& tolerance, IntegrationStatistics& statistics);
};

/// All of them, the default one first; and their names.
const std::vector<Method>& methods();
std::vector<std::string> method_names();

/// The method of that name; null if there is none.
const Method* find_method(const std::string& name);

/// Settings of the integration of the equations of motion.
struct IntegrationSettings {
  std::string method = "radau";  ///< one of `methods`
  /// The default keeps the paper's Cases 1 and 2 within 1e-5 m and 1e-5 rad of the exact motion over their 30 s.
  double relative_tolerance = 3e-7;
  double absolute_tolerance = 3e-10;  ///< SI units
  /// Bounds the work of each millisecond to what real time allows, as the node needs; else to 30 times as much.
  bool keeps_up = false;

  Tolerance tolerance() const { return {relative_tolerance, absolute_tolerance}; }
};

/// The regularization speed of the friction in the integration, m/s: nu, or 0.3 m/s times the relative tolerance, at
/// most 1e-5 m/s, if that is more: a smaller one makes no difference at that tolerance. A contact of spin radius a_m
/// rotates on the spot at this speed over a_m: the share is less in proportion where a_m is below 5 cm.
double effective_regularization_speed(double nu, double spin_radius, const Tolerance& tolerance);

/// A sentence before a run of `duration` (s) by an explicit method: which steps are stable, about 3 over the fastest
/// rate of a rolling roller (friction's f N / nu or mu_0, against J_2), and how long that may take. Else empty.
std::string advice(const RobotParameters& robot, const FloorParameters& floor, Model model,
                   const IntegrationSettings& settings, double duration);

/// The reason why `method` cannot integrate this robot, in words for an error message; empty if it can.
std::string refusal(const Method& method, const RobotParameters& robot, Model model);

/// A motion from `start` at t = 0, or one that continues another one's there.
struct MotionStart {
  Model model;
  const RobotParameters& robot;
  const FloorParameters& floor;
  const State& start;
  const TorqueProfile& torque;
  const IntegrationSettings& settings;
  bool extended = false;                ///< else parameters beyond the paper have no effect on models 2a and 2b
  const MotionSoFar* before = nullptr;  ///< what it continues, if anything
};

/// Makes an integrator by the method of the settings, which must not be refused; model 1 has its own. Throws
/// std::invalid_argument for an unknown name. `motion.torque` must outlive the result.
std::unique_ptr<MotionIntegrator> make_integrator(const MotionStart& motion);

}  // namespace youbot_base_sim
