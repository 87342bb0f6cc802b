#include "youbot_base_sim/integration/rest_friction.h"

#include <algorithm>
#include <cmath>

namespace youbot_base_sim {

RestFriction::RestFriction(const RobotParameters& robot, double nu, double holding)
    : nu_(nu),
      speeds_{std::min(nu, kSlow), std::sqrt(std::min(nu, kSlow) * holding), holding},
      holds_(std::isfinite(nu) && holding > 0 && holding < speeds_[0]),
      rho_X_(robot.rho_X()),
      rho_Y_(robot.rho_Y()),
      R_(robot.R),
      dry_friction_rate_(robot.dry_friction_rate),
      holds_drives_(robot.dry_friction_rate * robot.R <= 2 * speeds_[0]) {}

bool RestFriction::may_change(const Velocities& u, const Velocities& w) const {
  const double dX = w.v[0] - u.v[0], dY = w.v[1] - u.v[1], square = u.v[0] * u.v[0] + u.v[1] * u.v[1];
  if (keeps_moving(0.5 * square - dX * dX - dY * dY)) return false;
  return past_change(speed(u)) + speed(w - u) > 0;
}

void RestFriction::change(const Velocities& u) {
  if (past_slower(speed(u)) > past_faster(speed(u))) {
    ++level_;
  } else {
    --level_;
  }
}

double RestFriction::dry_friction_rate() const {
  if (!holds_drives_ || level_ == 0) return dry_friction_rate_;
  return nu() / speeds_[0] * dry_friction_rate_;
}

double RestFriction::past_change(double speed) const { return std::max(past_slower(speed), past_faster(speed)); }

// The speed of the platform at the wheels or of a wheel's rim, whichever is fastest, m/s.
double RestFriction::speed(const Velocities& u) const {
  const Wheels along = u.v[0] - rho_Y_ * u.v[2], across = u.v[1] + rho_X_ * u.v[2];
  const Wheels squares = (along.square() + across.square()).max((R_ * u.dphi).square());
  return std::sqrt(squares.maxCoeff());
}

}  // namespace youbot_base_sim
