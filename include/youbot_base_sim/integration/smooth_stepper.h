#pragma once

#include <boost/numeric/odeint/stepper/controlled_step_result.hpp>
#include <boost/numeric/odeint/stepper/stepper_categories.hpp>
#include <boost/numeric/odeint/util/is_resizeable.hpp>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// The types that odeint asks of a Controlled Stepper that works on a State.
struct ControlledStepperTypes {
  using state_type = State;
  using deriv_type = State;
  using value_type = double;
  using time_type = double;
  using stepper_category = boost::numeric::odeint::controlled_stepper_tag;
  using Result = boost::numeric::odeint::controlled_step_result;
};

/// A System of odeint between two events: what a method that is made for any equations knows of them.
class SmoothSystem {
 public:
  virtual ~SmoothSystem() = default;

  /// Sets dxdt to dx/dt at time t, s.
  virtual void operator()(const State& x, State& dxdt, double t) const = 0;
  /// The longest step from x at time t (s) in which no more happens than a method's few stages see. Contacts that hold
  /// at each of them hide all else from every estimate of the error: the phase of a torque, the rows of a table, how
  /// friction changes along the way of a contact, friction of bearings that reverses, how the platform's frame rotates.
  virtual double max_step(const State& x, double t) const = 0;
  /// True if more has happened in a step from `start` to `end` than max_step foresaw at its start.
  virtual bool jumps(const State&, const State&) const { return false; }
  /// Distance by which difference_jacobian moves each entry of the state.
  virtual State increments() const = 0;
  /// Wheel angles in the middle of the contacts' ranges, rad; not finite where a range has no end.
  virtual Wheels middle() const = 0;

 protected:
  /// Angle by which the platform may rotate in a step, rad: errors of its velocities, which no slip damps on ice, are
  /// those of a harmonic of this phase.
  static constexpr double kMaxTurn = 0.125;
};

/// A method of integration between two events, where the right-hand side is smooth: a Controlled Stepper of odeint. It
/// may be made for one class of System, to which it then casts what it is given.
class SmoothStepper : public ControlledStepperTypes {
 public:
  virtual ~SmoothStepper() = default;

  /// Tries a step of length dt (s) from `in` at time t to `out`. On success t is that of its end, and dt is the length
  /// recommended for the next step; on failure t stays, and dt is a length that is worth trying. A call with the same
  /// `in` and t repeats the step with another length.
  virtual Result try_step(const SmoothSystem& system, const State& in, double& t, State& out, double& dt) = 0;
  Result try_step(const SmoothSystem& system, State& x, double& t, double& dt) { return try_step(system, x, t, x, dt); }

  /// True if the method knows the states within its steps.
  virtual bool interpolates() const { return false; }
  /// Sets x to the state after this share of the last try, which must have succeeded: 0 to 1, or up to 1 % after its
  /// end.
  virtual void state_within([[maybe_unused]] const SmoothSystem& system, [[maybe_unused]] double share,
                            [[maybe_unused]] State& x) const {}

  /// The right-hand side jumps here: forgets what does not hold on both sides.
  virtual void reset() = 0;

  /// Forgets all steps so far.
  virtual void restart() { reset(); }
};

}  // namespace youbot_base_sim

/// A State never changes its size: odeint's range_algebra works on it in place.
template <>
struct boost::numeric::odeint::is_resizeable<youbot_base_sim::State> : boost::false_type {
  using type = boost::false_type;
  static const bool value = false;
};
