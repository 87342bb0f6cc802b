#include "youbot_base_sim/slip_odometry/follow_wheel_angles.h"

#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/drive/wheel_odometry.h"

namespace youbot_base_sim {

std::unique_ptr<Simulation> follow_wheel_angles(Scene scene, const std::shared_ptr<const WheelMotion>& motion,
                                                const Wheels& offset, bool compliant) {
  static constexpr double kPeriod = 5e-3, kStiffness = 20, kDamping = 0.5;  // s, N m/rad, N m s/rad
  const Wheels rates = motion->rate(0);
  const DriverKinematics rolling{scene.robot.R, scene.robot.h + scene.robot.l};
  scene.initial = State();
  scene.initial.phi() = motion->angle(0) + offset;
  scene.initial.values.col(1).head<3>() = rolling.velocity(rates).array();
  NoSlipModel(scene.robot).constrain(scene.initial);
  scene.initial.dphi() = rates;
  scene.load_schedule = {};
  scene.solver.control_period = compliant ? kPeriod : 0;
  if (compliant) {
    return std::make_unique<Simulation>(scene, [motion, offset](double t, const State& x) -> Wheels {
      return kStiffness * (motion->angle(t) + offset - x.phi()) + kDamping * (motion->rate(t) - x.dphi());
    });
  }
  scene.drive = motion;
  return std::make_unique<Simulation>(scene);
}

}  // namespace youbot_base_sim
