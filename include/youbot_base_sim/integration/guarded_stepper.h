#pragma once

#include <atomic>
#include <cstdint>
#include <functional>

#include "youbot_base_sim/integration/contact_system.h"
#include "youbot_base_sim/integration/event_locating_stepper.h"
#include "youbot_base_sim/integration/motion_record.h"

namespace youbot_base_sim {

/// Bounds the work of an EventLocatingStepper: a Controlled Stepper of odeint around it. Work is counted in evaluations
/// of the right-hand side, so that results do not depend on the machine.
///
/// A millisecond of motion that has used up its bound gets kExtraBudget more, in which wheels that chatter are held
/// early. If that is not enough, or steps become too short to advance t, fallback steps cover the next millisecond, and
/// twice as long each time this recurs within kFallbackCooldown. Events have their effects after each of these.
class GuardedStepper : public ControlledStepperTypes {
 public:
  /// Advances x, from time t by dt (s), by a step that never fails and keeps all contacts, of which none is shared.
  using Fallback = std::function<void(State& x, double t, double dt)>;

  /// Spends `max_evaluations` on a millisecond of motion. Records in `record`, which must outlive it.
  GuardedStepper(EventLocatingStepper stepper, Fallback fallback, std::uint64_t max_evaluations, MotionRecord& record);

  /// EventLocatingStepper's, but it never fails: it tries again itself. Throws Stopped once the stop flag is set.
  Result try_step(ContactSystem& system, State& x, double& t, double& dt, bool finishes = true);

  /// EventLocatingStepper's, for a step from time t (s) and for the last one.
  bool interpolates(double t) const { return !(t < fallback_end_) && stepper_.interpolates(); }
  void state_at(double t, const ContactSystem& system, State& x) const { stepper_.state_at(t, system, x); }
  void finish(ContactSystem& system, State& x, double t) { stepper_.finish(system, x, t); }

  /// See MotionIntegrator::stop_on.
  void stop_on(const std::atomic<bool>& stop) { stop_ = &stop; }

  /// See EventLocatingStepper::torque_jumped.
  void torque_jumped() { stepper_.torque_jumped(); }

 private:
  static constexpr double kWindow = 1e-3;                             // s
  static constexpr double kExtraBudget = 0.8;                         // of the bound
  static constexpr int kMaxFailures = 400;                            // of one step
  static constexpr double kFallbackStep = 2e-5;                       // s
  static constexpr double kMinDuration = 1e-3, kMaxDuration = 64e-3;  // s of fallback steps in a row
  static constexpr double kFallbackCooldown = 10e-3;                  // s after the last of them

  void begin_window(const ContactSystem& system, double t);
  bool save_work();
  void begin_fallback(double t);
  void fall_back(ContactSystem& system, State& x, double& t, double dt);

  EventLocatingStepper stepper_;
  Fallback fallback_;
  std::uint64_t max_evaluations_;
  MotionRecord* record_;
  const std::atomic<bool>* stop_ = nullptr;  // null: never

  // The millisecond under way: its start (infinite: none yet), and how many evaluations there may be by its end.
  double window_start_ = kInfinity;
  std::uint64_t allowed_ = 0;

  double fallback_end_ = -kInfinity, fallback_duration_ = kMinDuration;  // s
};

}  // namespace youbot_base_sim
