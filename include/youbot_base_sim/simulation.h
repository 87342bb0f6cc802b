#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "youbot_base_sim/drive/control_time.h"
#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/export.h"
#include "youbot_base_sim/integration/motion_integrator.h"
#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/physics/applied_loads.h"
#include "youbot_base_sim/physics/contacts.h"
#include "youbot_base_sim/physics/power_balance.h"
#include "youbot_base_sim/physics/roller_switch.h"
#include "youbot_base_sim/physics/torque_profile.h"
#include "youbot_base_sim/scene/scene.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// The loads and wrenches from an instant on.
struct LoadChange {
  double t;              ///< s
  double psi;            ///< heading of the base then, rad
  AppliedLoads applied;  ///< all of it, the scene's too
  bool loads, wrenches;  ///< true for what has changed
};

/// A jump of the base's state, by `set_state`: its state from an instant on.
struct StateChange {
  double t;  ///< s
  State state;
};

/// Events in a part of the motion, each list in order of time.
struct Events {
  std::vector<RollerSwitch> switches;
  std::vector<LoadChange> load_changes;
  std::vector<StateChange> state_changes;
  bool any() const { return !switches.empty() || !load_changes.empty() || !state_changes.empty(); }
};

class PrescribedWheels;

/// One running simulation, pulled by its caller: commands in; state, switches, contacts and statistics out.
///
/// Without a control period the scene's torque acts continuously. With one, control period k begins at k * period: the
/// drive is sampled there, and its torque is held to the end. The motion does not depend on how periods are grouped
/// into calls. A caller's torque or set points replace the scene's drive from then on:
///
///     while (simulation.time() < 10) {
///       simulation.set_torque(controller(simulation.time(), simulation.state()));
///       simulation.step();
///     }
class Simulation {
 public:
  /// At t = 0, with the scene's own drive (no torque if it has none).
  explicit Simulation(const Scene& scene);
  ~Simulation();

  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  /// Advances to time t (s); does nothing if that has passed. Where accurate integration takes too much work, it
  /// continues less accurately, and the statistics count it. Throws std::domain_error where the equations have no
  /// finite solution, TippedOver at the tipping limit, and Stopped.
  void advance_to(double t);

  /// Advances to the end of the present control period; std::logic_error if the scene has none.
  void step();

  /// True if a control period begins now; end of the one that goes on or begins now, s (infinity without one).
  bool period_begins() const { return sampled() && ControlTime::reached(segment_end_, t_); }
  double period_end() const { return sampled() ? control_time_.begin(control_time_.ended_by(t_) + 1) : kInfinity; }

  /// The torque of the wheels from now on, N m, exactly and until it is set anew. Without a control period each
  /// `advance_to` then ends an integration step. std::logic_error where the scene prescribes wheel angles.
  void set_torque(const Wheels& torque);

  /// The set points of the scene's motors (or default ones) from now on: torques (N m) or wheel rates (rad/s), by their
  /// delay, limits and velocity loops, at each control period. std::logic_error without one.
  void set_points(DriveMode mode, const Wheels& values);

  /// Has `advance_to` and `step` throw Stopped once `stop`, which must outlive this, is set; then only `reset` is left.
  void stop_on(const std::atomic<bool>& stop);

  /// Back to the scene's initial state and drive at t = 0, statistics included.
  void reset();

  double time() const { return t_; }  ///< s
  const State& state() const { return state_; }

  /// Torque that acts now, N m; where the scene prescribes wheel angles, the reaction.
  Wheels torque() const;

  /// Number 0 .. n-1 of the roller that each wheel stands on.
  std::array<int, kWheels> rollers() const;

  /// For a wheel that rests between two rollers, its neighbour that stands on the floor too.
  std::array<std::optional<int>, kWheels> other_rollers() const;

  /// Angle of roller k of wheel i about its own axis, rad; it changes only while the roller is on the floor.
  double roller_angle(int i, int k) const;

  /// Slip, friction, normal reaction and offset of the contact points; in model 1, no slip and no force.
  ContactDetails contacts() const { return integrator_->contacts(local_, t_); }

  /// From now on these loads and wrenches replace those of the last call; they act in addition to the scene's. The base
  /// keeps its velocities or, with `keep_momentum`, its momentum; the change of kinetic energy counts as work.
  void set_loads(const AppliedLoads& applied, bool keep_momentum = false);

  /// Sets the pose x, y (m) and heading (rad) in the fixed frame, the velocity V_X, V_Y (m/s), Omega (rad/s) in the
  /// platform's frame and, if given, the wheel angles phi (rad). Wheels and rollers then roll without slip. Time,
  /// torque, loads and wrenches go on; the change of kinetic energy counts as work.
  void set_state(const Eigen::Vector3d& pose, const Eigen::Vector3d& velocity, const std::optional<Wheels>& phi);

  /// State changes since the last call, in order of time. The list grows until it is taken.
  std::vector<StateChange> take_state_changes() { return std::exchange(state_changes_, {}); }

  /// The present loads and wrenches, those of the scene included.
  const AppliedLoads& applied_loads() const { return applied_loads_; }

  /// Load changes since the last call, in order of time. The list grows until it is taken.
  std::vector<LoadChange> take_load_changes() { return std::exchange(load_changes_, {}); }

  /// Extremes of the normal reactions; empty where they are static.
  std::optional<ReactionRecord> reaction_record() const { return integrator_->reaction_record(); }

  /// Lets the motion continue at the tipping limit, where the advancing functions otherwise throw TippedOver.
  void continue_when_tipping();

  /// Power by its use, now, W: in sum the rate of change of kinetic energy, but for switches that stop parts.
  PowerBalance power_balance() const;

  /// Switches since the last call, in order of time. The list grows until it is taken.
  std::vector<RollerSwitch> take_switches() { return integrator_->take_switches(); }

  /// All of these at once.
  Events take_events() { return {take_switches(), take_load_changes(), take_state_changes()}; }

  /// If time() lies within a step, that step is counted.
  const IntegrationStatistics& statistics() const { return integrator_->statistics(); }

  /// effective_regularization_speed of the scene's friction, m/s; infinite for models without one.
  double regularization_speed() const { return integrator_->regularization_speed(); }

  /// The name of the method that integrates: the scene's, or model 1's own.
  std::string method() const;

  double kinetic_energy() const { return integrator_->kinetic_energy(state_); }  ///< J

  /// |change of kinetic energy - integrated power| since t = 0, J.
  double energy_balance_error() const { return std::abs(kinetic_energy() - initial_energy_ - state_.work()); }

  const Scene& scene() const { return scene_; }

 private:
  class SampledDrive;

  bool sampled() const { return control_time_.period() > 0; }
  const TorqueProfile& profile() const {
    if (continuous_) return *continuous_;
    return held_;
  }
  void begin_segment();
  void hold(const Wheels& torque);
  void leave_origin_at(double x, double y);
  void show_state();
  void make_integrator(const MotionSoFar* before);
  void change_integrator(const MotionSoFar& before);
  AppliedLoads with_added(AppliedLoads applied) const;
  void change_loads();
  void note_loads(double t);

  const Scene scene_;
  const ControlTime control_time_;
  State state_;
  State local_;             // the same, with its position from origin_: what is integrated
  Eigen::Vector2d origin_;  // in the fixed frame, m
  double t_;
  HeldTorque held_;
  std::unique_ptr<TorqueProfile> continuous_;  // null where the torque is held
  const PrescribedWheels* prescribed_;         // continuous_, where it moves wheels as prescribed
  std::unique_ptr<SampledDrive> drive_;        // null where none is sampled
  std::unique_ptr<MotionIntegrator> integrator_;
  const std::atomic<bool>* stop_ = nullptr;  // null: never
  bool continues_when_tipping_ = false;
  bool extended_;       // whether the equations have the physics beyond the paper
  double segment_end_;  // of the present control period, or of a smooth segment of the torque, s
  double initial_energy_;
  double next_change_;          // of loads and wrenches, s
  AppliedLoads planned_;        // the scene's present ones
  AppliedLoads added_;          // besides those of the scene
  AppliedLoads applied_loads_;  // the present ones: both
  std::vector<LoadChange> load_changes_;
  std::vector<StateChange> state_changes_;
};

/// Advances a scene with a control period to time t (s); `controller(t, state)` returns the torques of a period, N m.
template <class Controller>
void advance_to(Simulation& simulation, double t, Controller&& controller) {
  while (!ControlTime::reached(t, simulation.time())) {
    if (simulation.period_begins()) simulation.set_torque(controller(simulation.time(), simulation.state()));
    simulation.advance_to(std::min(t, simulation.period_end()));
  }
}

}  // namespace youbot_base_sim
