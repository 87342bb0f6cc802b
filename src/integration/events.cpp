#include "youbot_base_sim/integration/events.h"

namespace youbot_base_sim {

double EdgeReached::time_to_edge(const ContactModes& modes, const State& x, const Wheels& ddphi) {
  double first = kInfinity;
  for (int i = 0; i < kWheels; ++i) {
    const double dphi = x.dphi()[i], way = (dphi < 0 ? modes.lower_edge() : modes.upper_edge())[i] - x.phi()[i];
    const double t = 2 * way / (dphi + std::copysign(std::sqrt(dphi * dphi + 2 * ddphi[i] * way), dphi));
    if (t > kTimeResolution && t < first) first = t;  // not a number: never
  }
  return first;
}

Effect EdgeReached::apply(ContactSystem& system, State& x, double t, int i) {
  ContactModes& modes = system.modes();
  const double phi = x.phi()[i];
  int direction = 0;
  if (phi >= modes.upper_edge()[i] - resolution(phi, x.dphi()[i])) direction = +1;
  if (phi <= modes.lower_edge()[i] + resolution(phi, x.dphi()[i])) direction = -1;
  if (direction == 0) return Effect::kNone;
  if (!moves(system, x, t, i, direction)) {
    modes.keep_inside(i, x);
    return Effect::kNone;
  }
  const std::int64_t from = modes.roller(i);
  const double hop = record_->sliding_mode.hop(i, t, direction);
  if (hop < kInfinity) {
    const Sharing sharing = system.sharing(i, x, t);
    if (!sharing.attractive && hop * std::abs(x.dphi()[i]) < SlidingMode::kHop) {  // it stands on the edge
      modes.widen(i, SlidingMode::kHop);
      return Effect::kNone;
    }
    const bool counts = sharing.error >= error_scale(tolerance_, x.velocities()).v[0];
    if (sharing.attractive && hop < SlidingMode::kLongestHop && (!counts || record_->sliding_mode.holds_early)) {
      ++record_->statistics.shared_contacts;
      if (counts) record_->statistics.forced_hold_speed += sharing.error;
      // Kicks may keep the wheel chattering: at least so many a second.
      record_->statistics.forced_hold_speed += sharing.kick / SlidingMode::kLongestHop;
      system.enter_sliding(i, direction > 0 ? from : from - 1, x, t);
      return Effect::kContact;
    }
  }
  const double edge = direction > 0 ? modes.upper_edge()[i] : modes.lower_edge()[i];
  modes.switch_roller(i, from + direction, x);
  x.phi()[i] = ContactModes::far_side(edge, direction);
  record_->record_switch(modes, i, from, t, x.phi()[i]);
  if (modes.above_location_limit(i, x)) {
    modes.enter_averaging(i);
    ++record_->statistics.averaged_contacts;
  }
  return Effect::kContact;
}

void EdgeReached::pass(ContactModes& modes, State& x, double t, double dt, int i, double start) const {
  const std::int64_t from = modes.roller(i), to = modes.roller_at(x.phi()[i]);
  if (from == to) return;
  const double edge = to > from ? modes.upper_edge()[i] : modes.lower_edge()[i];
  const double moved = x.phi()[i] - start, at = moved == 0 ? 0 : std::clamp((edge - start) / moved, 0.0, 1.0);
  modes.switch_roller(i, to, x);
  record_->record_switch(modes, i, from, t + at * dt, ContactModes::far_side(edge, to > from ? +1 : -1));
}

bool EdgeReached::moves(const ContactSystem& system, const State& x, double t, int i, int direction) {
  if (x.dphi()[i] != 0) return direction * x.dphi()[i] > 0;
  State dxdt;
  system(x, dxdt, t);
  return direction * dxdt.dphi()[i] > 0;
}

Effect SharingEnds::apply(ContactSystem& system, State& x, double t, int i) {
  const double alpha = system.sharing(i, x, t).alpha;
  if (alpha >= 0 && alpha <= 1) return Effect::kNone;
  ContactModes& modes = system.modes();
  const std::int64_t from = modes.roller(i), to = modes.lower_roller(i) + (alpha > 1 ? 1 : 0);
  if (to != from) {
    modes.switch_roller(i, to, x);
  } else {
    modes.set_roller(i, to);
  }
  modes.keep_inside(i, x);
  record->record_switch(modes, i, from, t, x.phi()[i]);  // nothing, if it stays on the roller that it reached last
  return Effect::kContact;
}

Effect AveragingEnds::apply(ContactSystem& system, State& x, double t, int i) {
  ContactModes& modes = system.modes();
  if (!(modes.below_resolution_limit(i, x) > 0)) return Effect::kNone;
  record->record_passed_rollers(modes, i, x, t);
  modes.set_roller(i, modes.roller(i));
  return Effect::kContact;
}

// A state may be past two changes at once.
Effect RestChanges::apply(ContactSystem& system, State& x, double, int) {
  Effect effect = Effect::kNone;
  for (; system.rest().margin(x.velocities()) > 0; effect = Effect::kFriction) system.change_rest(x.velocities());
  return effect;
}

}  // namespace youbot_base_sim
