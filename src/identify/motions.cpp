#include "youbot_base_sim/identify/motions.h"

#include <cmath>

namespace youbot_base_sim {

namespace {

constexpr double kJump = 0.3;                     // rad/s, of any wheel
constexpr double kMinLength = 1, kMaxLength = 4;  // s
constexpr int kHeldOut = 3;                       // every third motion is
constexpr double kUnchanged = 0.01;               // rad/s: two of the motor's rpm

}  // namespace

std::vector<Motion> motions(const DriveRecord& record) {
  std::vector<Motion> motions;
  const double end = record.duration();
  Motion motion{0, 0, true, false};
  Wheels first = Wheels::Zero(), before = Wheels::Zero();
  const auto finish = [&](double t, const Wheels& next) {
    motion.end = t;
    motions.push_back(motion);
    motion = {t, 0, true, (next != 0).any()};
    first = next;
  };
  for (std::size_t k = 0; k < record.commands.t.size() && record.commands.t[k] < end; ++k) {
    const double t = std::max(record.commands.t[k], 0.0);
    const Wheels& rate = record.commands.values[k];
    const bool long_enough = t >= motion.begin + kMinLength;
    const bool jump = ((rate - before).abs() > kJump).any();
    if (long_enough && (jump || (!motion.held && t >= motion.begin + kMaxLength))) {
      finish(t, rate);
    } else if (t <= motion.begin) {
      first = rate;
      motion.moving = (rate != 0).any();
    } else if (((rate - first).abs() > kUnchanged).any()) {
      motion.held = false;
      motion.moving = motion.moving || (rate != 0).any();
    }
    before = rate;
  }
  finish(end, first);
  int moving = 0;
  bool held_out = false;
  for (Motion& each : motions) {
    if (each.moving) held_out = ++moving % kHeldOut == 0;
    each.held_out = held_out;
  }
  return motions;
}

}  // namespace youbot_base_sim
