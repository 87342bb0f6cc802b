#pragma once

#include <array>

#include "youbot_base_sim/integration/radau_friction.h"
#include "youbot_base_sim/integration/radau_options.h"
#include "youbot_base_sim/integration/radau_stages.h"
#include "youbot_base_sim/integration/slip_system.h"

namespace youbot_base_sim {

/// The first guess of Newton's iterations. It continues the polynomials, of velocities and friction, through the start
/// and the stages of the step that ended here; those of a rejected one, from the same start, it interpolates. Without
/// either, all stages begin as the start.
template <class Model>
class RadauPrediction {
 public:
  using System = SlipSystem<Model>;
  using Start = RadauStart<Model>;
  using Stages = RadauStages<Model>;
  using Friction = typename Model::Friction;
  using StageContacts = std::array<typename Model::Contacts, RadauTableau::stages>;

  RadauPrediction() = default;
  RadauPrediction(const RadauPrediction&) = delete;
  RadauPrediction& operator=(const RadauPrediction&) = delete;

  /// A step whose stages are known: one that ended at the present start, or was tried from there.
  struct SolvedStep {
    Stages stages;
    double dt;  ///< s
    bool ended;
    // Set once it has ended:
    Velocities start;
    Friction start_friction;
    bool after_switch;  ///< whether it began with another contact
  };

  /// The step to predict from; null if there is none.
  const SolvedStep* known() const { return radau_options.predicts ? known_ : nullptr; }
  const SolvedStep* last() const { return known_; }
  /// True if the step before is known, and steps go on from its end.
  bool continues() const { return known_ && known_->ended; }

  /// Room for the stages of the next try.
  Stages& next_stages() {
    next_ = &steps_[known_ == &steps_[0]];
    return next_->stages;
  }
  /// The next try's stages, of a step of length dt (s), are solved: later tries are predicted from it, accepted or not.
  void keep(double dt) {
    known_ = next_;
    known_->dt = dt;
    known_->ended = false;
  }
  /// The step tried last from `start`, if it is known, is accepted.
  void accept(const Start& start) {
    if (!known_ || known_->ended) return;
    known_->ended = true;
    known_->start = start.u;
    known_->start_friction = start.friction;
    known_->after_switch = start.after_switch;
    end_friction_ = known_->stages.F[2];
    end_contact_ids_ = start.contact_ids;
  }
  /// Predicts nothing from the last step.
  void forget() { known_ = nullptr; }
  /// Forgets all steps.
  void restart() {
    forget();
    end_contact_ids_.setConstant(-1);  // none
  }

  /// The contacts among these with which the last accepted step ended.
  WheelMask unchanged(const ContactModes::Ids& ids) const { return ids == end_contact_ids_; }
  /// The friction at its end.
  const Friction& end_friction() const { return end_friction_; }

  /// Predicts the `stages` of a step of length dt (s) from `start` by the step that is known. If that has ended, the
  /// polynomial leaves its start out (degree 2) where dt is more than `far` of its lengths, and its first stage too (a
  /// line) where it began with a switch. The slip of contacts that grip is then the one that yields the friction: small
  /// errors of velocity would be large ones of friction. `contacts` are those of the last iterations, for its limit.
  [[gnu::flatten, gnu::noinline]] void predict(const System& system, const Start& start, const StageContacts& contacts,
                                               double dt, Stages& stages) const {
    const SolvedStep& known = *known_;
    const double offset = known.ended ? 1 : 0;
    const Velocities& from = known.ended ? known.start : start.u;
    const Friction& friction_from = known.ended ? known.start_friction : start.friction;
    const int nodes = known.ended && known.after_switch && radau_options.line_after_switch ? 2
                      : known.ended && dt > radau_options.far * known.dt                   ? 3
                                                                                           : 4;
    for (int j = 0; j < 3; ++j) {
      const double s = offset + RadauTableau::c[j] * dt / known.dt;
      const std::array<double, 4> weights = lagrange_weights(s, nodes);
      stages.u[j] = weighted(weights, from, known.stages.u);
      stages.F[j] = bounded_friction(system.model(), weighted(weights, friction_from, known.stages.F), contacts[j]);
    }
    if (known.ended) follow_friction(system, start, contacts, dt, stages);
  }

  /// Sets `stages` to what the start has. Where it carries friction over a switch, a step of length dt (s) that
  /// outlasts the transient begins with the friction before the switch, and with the slip that yields it.
  [[gnu::noinline]] void begin_as_start(const System& system, const Start& start, const StageContacts& contacts,
                                        double dt, Stages& stages) const {
    const bool longer_than_transient = start.carries_friction && dt > radau_options.switch_transient;
    stages.u.fill(start.u);
    stages.F.fill(longer_than_transient ? end_friction_ : start.friction);
    if (longer_than_transient) follow_friction(system, start, contacts, dt, stages);
  }

 private:
  // Changes the velocities at the stages so that the slip yields their friction. Near the largest friction, the slip
  // depends on it too much.
  void follow_friction(const System& system, const Start& start, const StageContacts& contacts, double dt,
                       Stages& stages) const {
    const Wheels phi[3] = {start.phi_at(0, dt, stages.u), start.phi_at(1, dt, stages.u), start.phi_at(2, dt, stages.u)};
    for (int j = 0; j < 3; ++j) {
      youbot_base_sim::follow_friction(system, stages.F[j], contacts[j], phi[j], radau_options.gripping_share,
                                       stages.u[j]);
    }
  }

  SolvedStep steps_[2];
  SolvedStep *known_ = nullptr, *next_ = nullptr;
  Friction end_friction_;
  ContactModes::Ids end_contact_ids_ = ContactModes::Ids::Constant(-1);  // none
};

}  // namespace youbot_base_sim
