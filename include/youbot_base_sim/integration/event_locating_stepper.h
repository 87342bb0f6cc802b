#pragma once

#include <algorithm>
#include <memory>
#include <tuple>

#include "youbot_base_sim/integration/contact_system.h"
#include "youbot_base_sim/integration/events.h"
#include "youbot_base_sim/integration/motion_record.h"
#include "youbot_base_sim/integration/tolerance.h"

namespace youbot_base_sim {

/// Lengths of steps that are worth trying, s: next, and what was good after the last switch and the last jump of the
/// torque, for the next one.
class StepLengths {
 public:
  double next() const { return next_; }

  /// A step was too long; `next` is worth trying.
  void rejected(double next) { next_ = next; }

  /// A step of `length` was good enough; `next` is worth trying.
  void accepted(double length, double next) {
    const double wanted = next_;
    next_ = next;
    if (after_jump_now_) after_jump_ = std::max(kGrowthAfterJump * next_, kLeastAfterJump);
    after_jump_now_ = false;
    if (length < wanted) next_ = std::max(next_, wanted);  // the bound cut it short, not its error
  }

  /// The step is over, whatever ended it.
  void ended() {
    if (after_switch_now_) after_switch_ = std::max(kFirstStep, next_);
    after_switch_now_ = false;
  }

  void switched() {
    next_ = after_switch_;
    after_switch_now_ = true;
  }
  void torque_jumped() {
    next_ = std::min(next_, after_jump_);
    after_jump_now_ = true;
  }

 private:
  static constexpr double kFirstStep = 1e-6;  // s
  // Factor on the length that was good after the last jump: an occasional rejected step costs less than short steps.
  static constexpr double kGrowthAfterJump = 1.6;
  // The least length that counts as good after a jump, s: times resolve it.
  static constexpr double kLeastAfterJump = 1e-12;

  double next_ = kFirstStep, after_switch_ = kFirstStep, after_jump_ = kInfinity;
  bool after_switch_now_ = false, after_jump_now_ = false;  // true if the step under way follows one
};

/// Steps that end where an event happens: a Controlled Stepper of odeint around a method for smooth equations.
///
/// A step is aimed just beyond the next edge, by the wheels' accelerations over the step before; dense output leads
/// back to it. Else Newton's method on the length locates a switch to 1e-12 s, or to the resolution of phi: each try is
/// a whole step from the same start. The wheel then stands on the far side of the edge, and the next step starts
/// afresh. A wheel exactly on an edge stands on the roller of (2.1), unless its motion leaves that roller at once; one
/// that touches it and goes back does not switch. Other events are located by bisection.
///
/// A step may have two phases, so that rows within steps leave the motion's bits alone: `try_step` without `finishes`
/// ends it, `state_at` reads states within it, and `finish` brings about the effects of events at its end. Between two
/// steps the motion stands at one of these points:
///
///     kFresh ---- try_step ----> kReplaced     effects at a given state x have yet to take place; they have, on a copy
///                                    |
///                             a step succeeds  (where none does, x stays as it is)
///                                    v
///     kSettled <---- finish ---- kEnded        effects at the end of a step have taken place; they have yet to
///         +---- a step succeeds ---->+
///
/// `torque_jumped` and `restart` lead from each to kFresh.
///
/// The length worth trying is remembered here, so that odeint may clip a step at the end of a control period.
class EventLocatingStepper : public ControlledStepperTypes {
 public:
  /// Records in `record`, which must outlive it.
  EventLocatingStepper(std::unique_ptr<SmoothStepper> method, const Tolerance& tolerance, MotionRecord& record);

  /// Tries a step of at most dt (s) from x at time t, to the first event; then dt is infinite. On failure x and t stay,
  /// and dt becomes less. The contacts of `system` change with the state; without `finishes`, not before `finish`.
  Result try_step(ContactSystem& system, State& x, double& t, double& dt, bool finishes = true);

  /// Brings about the effects of events at the end of the last step, which is x at time t (s), unless they have taken
  /// place, and records the normal reactions there. Throws TippedOver where they end the motion.
  void finish(ContactSystem& system, State& x, double t);

  /// `finish` after a step of length dt (s) from `start` to x at time t that another stepper took and no event ended.
  /// Then forgets all steps.
  void finish_foreign_step(ContactSystem& system, const State& start, State& x, double t, double dt);

  /// True if it knows the states within its steps; then, before `finish`, the one at time t within the last step.
  bool interpolates() const { return method_->interpolates(); }
  void state_at(double t, const ContactSystem& system, State& x) const {
    method_->state_within(system, (t - start_t_) / last_try_.length, x);
  }

  /// The torque jumps here: the next step is as long as was good after the last jump. A step that is not finished ended
  /// here.
  void torque_jumped();

  /// Forgets all steps so far.
  void restart();

  /// Length of the step that is tried next, s.
  double dt() const { return lengths_.next(); }

 private:
  static constexpr double kMergeRemainder = 0.99;    // of the bound: a step that would be longer goes to it
  static constexpr double kShrinkage = 0.2;          // of a step whose end is not finite, or a jump
  static constexpr double kMaxExtrapolation = 2e-3;  // of a step: so close to its end, states are as good as there

  enum class Point { kFresh, kReplaced, kEnded, kSettled };

  // A successful one.
  struct Try {
    State end;
    double length = 0;  // s
  };

  const State& start_after_effects(ContactSystem& system, const State& x, double t);
  bool try_length(ContactSystem& system, const State& start, double t, double length);
  bool end_at_events(ContactSystem& system, const State& start, double t);
  void end_at_brief_rest(ContactSystem& system, const State& start, double t);
  template <class Event>
  void end_at(const Event& event, ContactSystem& system, const State& start, double t);
  template <class Event>
  bool leaves_remainder(const Event& event, const ContactSystem& system, int condition, double& length);
  void settle(ContactSystem& system, State& x, double t);
  void note(Effect effect);

  std::unique_ptr<SmoothStepper> method_;
  MotionRecord* record_;
  std::tuple<EdgeReached, SharingEnds, AveragingEnds, RestChanges, TippingReached> events_;

  // The last two tries of the step under way; the length of the one that the method knows, not a number if that
  // failed; what is left to the event; s.
  Try last_try_, try_before_;
  double known_length_ = 0, residual_dt_ = 0;
  double next_dt_ = 0;  // worth trying after the last try

  StepLengths lengths_;
  double start_t_ = 0;             // of the last step, s
  Wheels ddphi_ = Wheels::Zero();  // mean over the last step, rad/s^2
  Point point_ = Point::kFresh;
  State x_, start_;  // at kReplaced: the given state, at time t_, and what effects have made of it
  double t_ = 0;
};

}  // namespace youbot_base_sim
