#pragma once

#include <limits>

#include "youbot_base_sim/drive/torque_profiles.h"
#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/no_slip_model.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// The paper's open-loop control (section 5.2): the torques under which model 1 performs the desired motion.
class ReferenceTorque : public TorqueProfile {
 public:
  ReferenceTorque(const RobotParameters& robot, const ReferenceMotion& motion);
  double begin_segment(double) override { return std::numeric_limits<double>::infinity(); }
  Wheels value(double t) const override;

 private:
  [[gnu::noinline, gnu::cold]] Wheels dry_value(double t) const;

  NoSlipModel model_;
  ReferenceMotion motion_;
  // Without dry friction the torques are quadratic in the velocities: they have no harmonics above the second.
  Wheels constant_, cos_, sin_, cos_2_, sin_2_;
};

}  // namespace youbot_base_sim
