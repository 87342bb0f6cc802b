#pragma once

#include <cstdint>
#include <utility>

#include "youbot_base_sim/integration/motion_record.h"
#include "youbot_base_sim/integration/rest_friction.h"
#include "youbot_base_sim/integration/smooth_stepper.h"
#include "youbot_base_sim/physics/contact_modes.h"

namespace youbot_base_sim {

/// The equations of motion for the contacts that the wheels have now, as events know them: a System of odeint, which is
/// smooth until an event changes its ContactModes or the level of its RestFriction.
class ContactSystem : public SmoothSystem {
 public:
  ContactSystem(ContactModes modes, const RestFriction& rest) : modes_(std::move(modes)), rest_(rest) {}

  Wheels middle() const override { return 0.5 * (modes_.lower_edge() + modes_.upper_edge()); }

  /// The contacts that the wheels have now. Events read and change them.
  ContactModes& modes() { return modes_; }
  const ContactModes& modes() const { return modes_; }

  /// The slip speed over which friction is regularized now; it changes by these functions only.
  const RestFriction& rest() const { return rest_; }
  void change_rest(const Velocities& u) {
    rest_.change(u);
    regularize_friction();
  }

  /// Filippov's coefficient of wheel i, which stands on an edge in state x at time t (s), whether that edge is
  /// attractive, and what it would cost to have the wheel rest there.
  virtual Sharing sharing(int i, const State& x, double t) const = 0;
  /// Stands wheel i of x at time t (s), which is at the upper edge of roller k, on rollers k and k + 1. Its momentum
  /// goes to the platform and the roller, through the contacts that took it.
  virtual void enter_sliding(int i, std::int64_t k, State& x, double t) = 0;

  /// True if normal reactions follow the motion; those in state x at time t (s).
  virtual bool reacts() const = 0;
  virtual FloorReactions reactions(const State& x, double t) const = 0;

  /// Evaluations of the right-hand side so far.
  std::uint64_t evaluations() const { return evaluations_; }
  void count_evaluations(std::uint64_t more) const { evaluations_ += more; }

 protected:
  /// Has friction follow the level of `rest_`, which has changed.
  virtual void regularize_friction() = 0;

  ContactModes modes_;
  RestFriction rest_;
  mutable std::uint64_t evaluations_ = 0;
};

}  // namespace youbot_base_sim
