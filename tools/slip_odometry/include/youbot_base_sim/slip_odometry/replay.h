#pragma once

#include <atomic>
#include <memory>

#include "youbot_base_sim/drive/prescribed_wheels.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// A simulation whose wheels follow `motion`, plus an offset. The base starts at the origin, rolling, without loads.
class Replay {
 public:
  /// `offset` in rad. If `compliant`, a spring and a damper draw each wheel to its angle: measured angles contain the
  /// ripple of the true rollers, with which wheels on other rollers would slip.
  Replay(Scene scene, std::shared_ptr<const WheelMotion> motion, const Wheels& offset, bool compliant);

  /// Advances as Simulation does.
  void advance_to(double t);
  void stop_on(const std::atomic<bool>& stop) { simulation_.stop_on(stop); }

  const Simulation& simulation() const { return simulation_; }
  void drop_switches() { simulation_.take_switches(); }  ///< which would gather

 private:
  const std::shared_ptr<const WheelMotion> motion_;
  const Wheels offset_;  // rad
  Simulation simulation_;
};

}  // namespace youbot_base_sim
