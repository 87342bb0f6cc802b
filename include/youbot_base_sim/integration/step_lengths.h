#pragma once

#include <algorithm>

#include "youbot_base_sim/physics/state.h"

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

}  // namespace youbot_base_sim
