#include "youbot_base_sim/slip_odometry/replay.h"

#include <utility>

#include "youbot_base_sim/physics/no_slip_model.h"

namespace youbot_base_sim {

namespace {

constexpr double kPeriod = 5e-3, kStiffness = 20, kDamping = 0.5;  // s, N m/rad, N m s/rad

Scene replayed(Scene scene, const std::shared_ptr<const WheelMotion>& motion, const Wheels& offset, bool compliant) {
  const Wheels rates = motion->rate(0);
  scene.initial = State();
  scene.initial.phi() = motion->angle(0) + offset;
  scene.initial.values.col(1).head<3>() = Rolling(scene.robot).velocity(rates).array();
  NoSlipModel(scene.robot).constrain(scene.initial);
  scene.initial.dphi() = rates;
  scene.load_schedule = {};
  scene.solver.control_period = compliant ? kPeriod : 0;
  scene.drive = std::monostate();
  if (!compliant) scene.drive = motion;
  return scene;
}

}  // namespace

Replay::Replay(Scene scene, std::shared_ptr<const WheelMotion> motion, const Wheels& offset, bool compliant)
    : motion_(std::move(motion)),
      offset_(offset),
      simulation_(replayed(std::move(scene), motion_, offset, compliant)) {}

void Replay::advance_to(double t) {
  if (simulation_.scene().solver.control_period == 0) return simulation_.advance_to(t);
  youbot_base_sim::advance_to(simulation_, t, [this](double begin, const State& x) -> Wheels {
    return kStiffness * (motion_->angle(begin) + offset_ - x.phi()) + kDamping * (motion_->rate(begin) - x.dphi());
  });
}

}  // namespace youbot_base_sim
