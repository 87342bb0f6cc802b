#pragma once

#include <Eigen/Dense>
#include <vector>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/state.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// The value of dgamma after a roller switch: the equations define it only for the roller in contact.
enum class RollerRateAtSwitch {
  kContinuous,  ///< dgamma is kept, as the paper's equations integrate it
  kAtRest       ///< the new roller starts at dgamma = 0, as one that its bearing has stopped
};

/// The rule by which the floor's reactions on the wheels follow from the motion.
enum class NormalReactions {
  kStatic,  ///< those of the base at rest (4.17)
  kDynamic  ///< vertical forces and moments balance at every instant
};

/// The fourth condition on the loads of four wheels, of which equilibrium determines three.
enum class LoadSharing {
  kEqualWheels,   ///< rigid frame, wheels of the same stiffness (4.16)
  kRockingFront,  ///< the front axle rolls freely about OX
  kRockingRear    ///< the rear axle does
};

/// The robot, in the paper's symbols; the defaults are its table (5.1). SI units.
struct RobotParameters {
  double m = 30.0;                   ///< mass of the body without wheels, kg
  double m_1 = 1.4;                  ///< mass of one wheel, kg
  double I_s = 4.42;                 ///< moment of inertia of the whole robot about OZ, kg m^2
  double J_1 = 5.87e-3;              ///< moment of inertia of a wheel about its axle, kg m^2
  double J_2 = 1e-6;                 ///< moment of inertia of a roller about its axis (regularisation), kg m^2
  double a_X = 0.016, a_Y = -0.026;  ///< centre of mass of the body from O, m
  double a_Z = 0;                    ///< its height above the axles, m
  double h = 0.235;                  ///< half the wheelbase, m
  double l = 0.15;                   ///< half the track, m
  double R = 0.05;                   ///< outer radius of a wheel, m
  double R_d = 0.0355;               ///< distance of the rollers' axes from the wheel's axle, m
  int rollers = 6;                   ///< rollers on a wheel, n
  /// Angle between a roller's axis and the wheel's plane, degrees, below 90; negative where the rollers on the floor
  /// point the other way than the paper's: on all wheels that is the O-configuration.
  Wheels roller_angle = Wheels::Constant(45);
  Wheels mu_1 = Wheels::Constant(0.11);         ///< viscous friction of a wheel's bearing, N m s
  Wheels mu_2 = Wheels::Constant(5.78e-3);      ///< viscous friction of a roller's bearing, N m s
  Wheels dry_friction = Wheels::Zero();         ///< of a wheel's drive, N m: see DryBearings
  double dry_friction_rate = 0.02;              ///< over which it is smoothed, rad/s
  Wheels roller_dry_friction = Wheels::Zero();  ///< T_2, of a roller's bearing, N m
  double roller_dry_friction_rate = 2;          ///< over which it is smoothed, rad/s: real bases' (docs/validation.md)
  RollerRateAtSwitch roller_rate_at_switch = RollerRateAtSwitch::kContinuous;
  NormalReactions normal_reactions = NormalReactions::kStatic;
  LoadSharing load_sharing = LoadSharing::kEqualWheels;  ///< of dynamic reactions
  bool averaged_contacts = false;  ///< each wheel's contact is averaged over its rollers, as those of fast wheels are
  double q = 0;  ///< diagonal preload: what an uneven floor or a twisted frame adds to N_1, N_4, takes from N_2, N_3, N

  double m_s() const { return m + kWheels * m_1; }  ///< total mass, kg
  Wheels rho_X() const { return {h, h, -h, -h}; }   ///< wheel centres from O, forward, m
  Wheels rho_Y() const { return {l, -l, l, -l}; }   ///< wheel centres from O, to the left, m

  /// Directions delta, by functions, of the axes of the rollers in contact: -45, 45, 45, -45 deg (paper, section 2), or
  /// the `roller_angle` with these signs. Exact at 45 deg.
  Wheels tan_delta() const;
  Wheels cos_delta() const { return (1 / (1 + tan_delta().square())).sqrt(); }
  Wheels sin_delta() const { return cos_delta() * tan_delta(); }
};

/// The robot with the mostly dry friction of two real bases. `scale` multiplies it: 0.76 is one of them, 1.3 the other.
RobotParameters measured_robot(double scale = 1);

/// A rectangle of the floor with a friction of its own, which changes into that around it across a soft edge.
struct FloorPatch {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;  ///< its corners in the fixed frame, m; x0 < x1, y0 < y1
  double friction = 0;                    ///< f in it
  double edge = 0.01;                     ///< w, width of the soft edge, m
};

/// The floor. SI units; f and nu as in section 5.2 of the paper.
struct FloorParameters {
  Wheels f = Wheels::Constant(0.5);  ///< coefficient of sliding friction, under each wheel
  double nu = 1e-3;                  ///< slip speed below which limited friction is regularised, m/s
  double g = 9.81;                   ///< gravity, m/s^2
  double viscous_friction = -1;      ///< mu_0 of model 2a, N s/m; negative: f m_s g / (4 nu), the paper's choice
  double slope = 0;                  ///< angle of the floor with the horizontal, rad
  double uphill = 0;                 ///< heading of steepest ascent in the fixed frame, rad
  double spin_radius = 0;            ///< a_m: spin friction is as of slip at this distance from the contact point, m
  double holding_speed = 0;          ///< in place of nu while a base under limited friction rests, m/s; 0: nu
  std::vector<FloorPatch> patches;   ///< later ones lie on top

  /// Coefficient of friction at the contact points (X, Y) in the fixed frame, m; smooth over the edges of patches.
  Wheels friction_at(const Wheels& X, const Wheels& Y) const;

  /// Distance (m) that contact points at (X, Y) may move in a step without jumping over a patch's soft edge.
  double max_distance(const Wheels& X, const Wheels& Y) const;

  /// Viscous friction of the contacts in model 2a, N s/m.
  Wheels mu_0(const RobotParameters& robot) const {
    if (viscous_friction >= 0) return Wheels::Constant(viscous_friction);
    return f * robot.m_s() * g / (kWheels * nu);
  }
};

/// Static normal reactions of the floor on the wheels, N (paper, (4.17), with the diagonal preload and, on a slope, the
/// part of gravity that presses on the floor). Non-positive where a wheel would lift.
Wheels normal_reactions(const RobotParameters& robot, const FloorParameters& floor);

}  // namespace youbot_base_sim
