#pragma once

#include <atomic>
#include <exception>
#include <optional>
#include <vector>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/physics/applied_loads.h"
#include "youbot_base_sim/physics/contact_modes.h"
#include "youbot_base_sim/physics/contacts.h"
#include "youbot_base_sim/physics/reaction_record.h"
#include "youbot_base_sim/physics/roller_switch.h"
#include "youbot_base_sim/physics/state.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Thrown out of an integration once its stop flag is set.
class Stopped : public std::exception {
 public:
  const char* what() const noexcept override { return "stopped"; }
};

/// The part of a motion that is not in the state, for another integration to continue. Step sizes, chatter and
/// the level of friction at rest begin anew.
struct MotionSoFar {
  std::optional<ContactModes> contacts;  ///< none in model 1, and where contacts begin anew
  IntegrationStatistics statistics;
  std::optional<ReactionRecord> reactions;  ///< none where they are static
  std::vector<RollerSwitch> switches;       ///< not yet taken
};

/// Integrates the motion of one model by one method.
class MotionIntegrator {
 public:
  virtual ~MotionIntegrator() = default;

  /// Advances x from time t to t_end (s). The torque is smooth up to `smooth_end` (s), at t_end or later: a step may
  /// end there, with x within it, and the next call goes on from its end. So x stays as it is between two calls, unless
  /// `torque_jumped` or `set_loads` is called; statistics may be one step further.
  virtual void advance(State& x, double t, double t_end, double smooth_end) = 0;

  /// Has `advance` throw Stopped within a step once `stop`, which must outlive this, is set: by
  /// another thread or a signal's handler. The state is then somewhere on the way.
  virtual void stop_on(const std::atomic<bool>& stop) = 0;

  /// The torque has jumped since the last call of `advance`.
  virtual void torque_jumped() = 0;

  /// Sets the rates of x at time t (s) that have no inertia, of rollers with J_2 = 0, to those of the equations.
  virtual void constrain([[maybe_unused]] State& x, [[maybe_unused]] double t) const {}

  /// Replaces the loads and wrenches from now on. The base keeps its velocities or, with `keep_momentum`, its momentum;
  /// the change of kinetic energy counts as work. Throws std::logic_error for the paper's models, which have neither.
  virtual void set_loads(State& x, const AppliedLoads& applied, bool keep_momentum) = 0;

  /// Ends this integration, for another one to continue the motion.
  virtual MotionSoFar leave() = 0;

  virtual double kinetic_energy(const State& x) const = 0;              ///< J
  virtual ContactDetails contacts(const State& x, double t) const = 0;  ///< model 1: no slip, no friction
  virtual const IntegrationStatistics& statistics() const = 0;

  // Model 1 has none of these.

  virtual const ContactModes* contact_modes() const { return nullptr; }  ///< null in model 1
  virtual double regularization_speed() const { return kInfinity; }      ///< of the friction, m/s; infinite: none
  virtual std::vector<RollerSwitch> take_switches() { return {}; }       ///< since the last call, in order of time

  /// Extremes of the normal reactions; empty where they are static.
  virtual std::optional<ReactionRecord> reaction_record() const { return std::nullopt; }

  /// Lets the motion continue at the tipping limit, where it otherwise throws TippedOver.
  virtual void continue_when_tipping() {}
};

}  // namespace youbot_base_sim
