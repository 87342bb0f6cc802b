#pragma once

#include <cmath>
#include <limits>

#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

/// Friction force at the contact points, N, in the platform's frame; one entry for each wheel.
struct alignas(kAlignment) ContactForce {
  Wheels F_X, F_Y;
};

inline ContactForce operator+(const ContactForce& a, const ContactForce& b) { return {a.F_X + b.F_X, a.F_Y + b.F_Y}; }
inline ContactForce operator*(double factor, const ContactForce& a) { return {factor * a.F_X, factor * a.F_Y}; }

/// -dF/dV_P, symmetric and positive semidefinite, N s/m.
struct ContactStiffness {
  Wheels XX, XY, YY;
};

// A contact law is a policy of SlipModel, selected once at construction so that the inner loops do not branch on it: a
// class with the functions below, free of allocation and branches. A new law is one more class here and one more entry
// in `Model` (model.h) and a file like src/integration/coulomb_methods.cpp.

/// Model 2a: F = -mu_0 V_P (paper, (4.10)), with the same mu_0 under all wheels.
class ViscousLaw {
 public:
  ViscousLaw(const RobotParameters& robot, const FloorParameters& floor) : mu_0_(floor.mu_0(robot)[0]) {}

  /// Force for the slip velocity V_P, m/s.
  ContactForce force(const Wheels& V_PX, const Wheels& V_PY) const { return {-mu_0_ * V_PX, -mu_0_ * V_PY}; }

  ContactStiffness stiffness(const Wheels&, const Wheels&) const {
    return {Wheels::Constant(mu_0_), Wheels::Zero(), Wheels::Constant(mu_0_)};
  }
  ContactStiffness stiffness(const Wheels& V_PX, const Wheels& V_PY, const ContactForce&) const {
    return stiffness(V_PX, V_PY);
  }
  ContactForce bounded(const ContactForce& F) const { return F; }
  double transition_speed() const { return std::numeric_limits<double>::infinity(); }
  void set_transition_speed(double) {}

 private:
  double mu_0_;
};

/// Model 2b: F = -f N V_P / sqrt(nu^2 + |V_P|^2), Coulomb friction (4.11) regularised as in section 5.2 of the paper.
class CoulombLaw {
 public:
  CoulombLaw(const RobotParameters& robot, const FloorParameters& floor)
      : limit_(floor.f * normal_reactions(robot, floor)), nu_(floor.nu), nu_squared_(floor.nu * floor.nu) {}

  /// Force for the slip velocity V_P, m/s.
  ContactForce force(const Wheels& V_PX, const Wheels& V_PY) const {
    const Wheels slope = limit_ * (nu_squared_ + V_PX.square() + V_PY.square()).sqrt().inverse();
    return {-slope * V_PX, -slope * V_PY};
  }

  ContactStiffness stiffness(const Wheels& V_PX, const Wheels& V_PY) const {
    const Wheels inverse_speed = (nu_squared_ + V_PX.square() + V_PY.square()).sqrt().inverse();
    const Wheels slope = limit_ * inverse_speed;
    const Wheels X = V_PX * inverse_speed;
    const Wheels Y = V_PY * inverse_speed;
    // nu^2 + V_PY^2 rather than 1 - X^2: no cancellation in full slip.
    const Wheels regular = nu_squared_ * inverse_speed.square();
    return {slope * (regular + Y.square()), -slope * X * Y, slope * (regular + X.square())};
  }

  /// The stiffness for a force F within the limit that is not yet the force of V_P: the derivative of
  /// F sqrt(nu^2 + V_P^2) = -f N V_P by both F and V_P (Chan, Golub and Mulet, SIAM J. Sci. Comput. 20(6), 1999, for
  /// another problem of this form). With it Newton's iterations converge even where V_P is off by far more than nu.
  ContactStiffness stiffness(const Wheels& V_PX, const Wheels& V_PY, const ContactForce& F) const {
    const Wheels inverse_speed = (nu_squared_ + V_PX.square() + V_PY.square()).sqrt().inverse();
    const Wheels slope = limit_ * inverse_speed;
    const Wheels X = V_PX * inverse_speed.square();
    const Wheels Y = V_PY * inverse_speed.square();
    return {slope + F.F_X * X, 0.5 * (F.F_X * Y + F.F_Y * X), slope + F.F_Y * Y};
  }

  /// The transition speed nu, over which friction is regularised, m/s.
  double transition_speed() const { return nu_; }
  void set_transition_speed(double nu) {
    nu_ = nu;
    nu_squared_ = nu * nu;
  }

  /// F, shortened to the largest friction, f N.
  ContactForce bounded(const ContactForce& F) const {
    const Wheels scale = (limit_ * (F.F_X.square() + F.F_Y.square()).max(1e-300).sqrt().inverse()).min(1);
    return {scale * F.F_X, scale * F.F_Y};
  }

 private:
  alignas(kAlignment) Wheels limit_;  // f N, N
  double nu_, nu_squared_;
};

}  // namespace youbot_base_sim
