#include "youbot_base_sim/sensors/motor_sensors.h"

#include "youbot_base_sim/sensors/normal_noise.h"

namespace youbot_base_sim {

const MotorReadings& MotorSensors::read(const Wheels& phi, const Wheels& dphi, const Wheels& torque,
                                        const Faults& faults) {
  if ((faults.encoder_slip != 0).any()) missed_ += faults.encoder_slip * (phi - phi_);
  phi_ = phi;
  MotorReadings now{phi - missed_, (1 - faults.encoder_slip) * dphi, torque};
  if (faults.encoder_noise > 0) now.phi += faults.encoder_noise * normal_noise(random_);
  now = transmitted(now);
  for (int i = 0; i < kWheels; ++i) {
    if (faults.ethercat_lost || faults.silent[i]) continue;
    readings_.phi[i] = now.phi[i];
    readings_.dphi[i] = now.dphi[i];
    readings_.torque[i] = now.torque[i];
  }
  return readings_;
}

}  // namespace youbot_base_sim
