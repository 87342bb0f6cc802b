#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
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

/// The part of a motion that is not in the state, for another integration to continue. Step lengths and counts of
/// reversals are not in it: they begin anew.
struct MotionSoFar {
  std::optional<ContactModes> contacts;  ///< none in model 1, and where contacts begin anew
  IntegrationStatistics statistics;
  std::optional<ReactionRecord> reactions;  ///< none where they are static
  std::vector<RollerSwitch> switches;       ///< that were not taken
};

/// Integrates the motion of one model by one method.
class MotionIntegrator {
 public:
  virtual ~MotionIntegrator() = default;

  /// Called with k = 0 .. n-1 at the beginning of each of n control periods, and with n at the end of the last.
  using PeriodObserver = std::function<void(std::size_t k)>;

  /// Advances x, at the beginning of control period `first`, by n periods of length `period` (s). The torque is smooth
  /// over each; the observer may change it at the beginning of a period, and then calls `torque_jumped`. The result
  /// does not depend on how a run is grouped into calls.
  virtual void advance_periods(State& x, std::int64_t first, double period, std::size_t n,
                               const PeriodObserver& observer) = 0;

  /// Advances x from time t to t_end (s). The torque is smooth up to `smooth_end` (s), at t_end or later: a step may
  /// end there, with x within it, and the next call goes on from its end. So x stays as it is between two calls, unless
  /// `torque_jumped` or `set_loads` is called; statistics may be one step further.
  virtual void advance(State& x, double t, double t_end, double smooth_end) = 0;

  /// Has `advance` and `advance_periods` throw Stopped within a step once `stop`, which must outlive this, is set: by
  /// another thread or a signal's handler. The state is then somewhere on the way.
  virtual void stop_on(const std::atomic<bool>& stop) = 0;

  /// The torque has jumped since the last call of `advance` or since the control period before.
  virtual void torque_jumped() = 0;

  /// Sets the rates of x at time t (s) that have no inertia, of rollers with J_2 = 0, to those of the equations.
  virtual void constrain([[maybe_unused]] State& x, [[maybe_unused]] double t) const {}

  /// Replaces the loads and wrenches from now on. The base keeps its velocities or, with `keep_momentum`, its momentum;
  /// the change of kinetic energy counts as work. Throws std::logic_error for the paper's models, which have neither.
  virtual void set_loads(State& x, const AppliedLoads& applied, bool keep_momentum) = 0;

  /// Ends this integration, for another one to continue the motion.
  virtual MotionSoFar leave() = 0;

  /// Extremes of the normal reactions; empty where they are static.
  virtual std::optional<ReactionRecord> reaction_record() const = 0;

  /// Lets the motion continue at the tipping limit, where it otherwise throws TippedOver.
  virtual void continue_when_tipping() = 0;

  virtual double kinetic_energy(const State& x) const = 0;              ///< J
  virtual ContactDetails contacts(const State& x, double t) const = 0;  ///< model 1: no slip, no friction
  virtual std::int64_t roller(int i) const = 0;                         ///< on which wheel i stands, unwrapped
  virtual std::optional<std::int64_t> other_roller(int i) const = 0;    ///< the second one of a shared contact
  virtual double regularization_speed() const = 0;                      ///< of the friction, m/s; infinite: none
  virtual double resting_angle(int i, int k) const = 0;                 ///< of roller k, off the floor, rad
  virtual std::vector<RollerSwitch> take_switches() = 0;                ///< since the last call, in order of time
  virtual const IntegrationStatistics& statistics() const = 0;
};

}  // namespace youbot_base_sim
