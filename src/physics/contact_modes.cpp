#include "youbot_base_sim/physics/contact_modes.h"

#include <algorithm>

namespace youbot_base_sim {

namespace {

// An averaged contact is resolved again at this share of the rate at which it was averaged, so that it does not flip.
constexpr double kResolve = 0.8;

}  // namespace

ContactModes::ContactModes(const RobotParameters& robot, const Wheels& phi, double max_located_rate)
    : geometry_(robot),
      angle_off_floor_(static_cast<std::size_t>(kWheels * robot.rollers), 0.0),
      max_located_dphi_(max_located_rate * geometry_.pitch()),
      min_averaged_dphi_(kResolve * max_located_dphi_),
      rollers_(robot.rollers),
      J_2_(robot.J_2),
      rate_at_switch_(robot.roller_rate_at_switch) {
  for (int i = 0; i < kWheels; ++i) set_roller(i, roller_at(phi[i]));
  if (!robot.averaged_contacts) return;
  max_located_dphi_ = min_averaged_dphi_ = -1;  // even a wheel at rest is too fast to locate its switches
  for (int i = 0; i < kWheels; ++i) enter_averaging(i);
}

void ContactModes::begin_contact(int i, bool shared, bool averaged, double center, double lower, double upper) {
  ++ids_[i];
  shared_[i] = shared;
  averaged_[i] = averaged;
  shares_ = shared_.any();
  averages_ = averaged_.any();
  center_[i] = center;
  lower_edge_[i] = lower;
  upper_edge_[i] = upper;
}

void ContactModes::set_roller(int i, std::int64_t k) {
  roller_[i] = k;
  const double center = static_cast<double>(k) * geometry_.pitch();
  begin_contact(i, false, false, center, geometry_.upper_edge(k - 1), geometry_.upper_edge(k));
}

void ContactModes::switch_roller(int i, std::int64_t k, State& x) {
  angle_off_floor_[index(i, wrapped(roller_[i], rollers_))] = x.gamma()[i];
  x.gamma()[i] = angle_off_floor_[index(i, wrapped(k, rollers_))];
  set_roller(i, k);
  if (rate_at_switch_ == RollerRateAtSwitch::kContinuous) return;
  // The bearing of the roller that leaves takes its energy.
  x.work() -= 0.5 * J_2_ * x.dgamma()[i] * x.dgamma()[i];
  x.dgamma()[i] = 0;
}

void ContactModes::share(int i, std::int64_t k) {
  lower_roller_[i] = k;
  begin_contact(i, true, false, static_cast<double>(k) * geometry_.pitch(), -kInfinity, kInfinity);
}

void ContactModes::enter_averaging(int i) { begin_contact(i, false, true, kInfinity, -kInfinity, kInfinity); }

void ContactModes::keep_inside(int i, State& x) const {
  x.phi()[i] = std::min(std::max(x.phi()[i], lower_edge_[i]), far_side(upper_edge_[i], -1));
}

}  // namespace youbot_base_sim
