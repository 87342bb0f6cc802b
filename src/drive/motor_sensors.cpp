#include "youbot_base_sim/drive/motor_sensors.h"

namespace youbot_base_sim {

const MotorReadings& MotorSensors::read(const Wheels& phi, const Wheels& dphi, const Wheels& torque,
                                        const Faults& faults) {
  missed_ += faults.encoder_slip * (phi - phi_);
  phi_ = phi;
  MotorReadings now{phi - missed_, (1 - faults.encoder_slip) * dphi, torque};
  if (faults.encoder_noise > 0) {
    std::normal_distribution<double> noise(0, faults.encoder_noise);
    for (int i = 0; i < kWheels; ++i) now.phi[i] += noise(random_);
  }
  now = transmitted(now);
  for (int i = 0; i < kWheels; ++i) {
    if (faults.silent[i]) continue;
    readings_.phi[i] = now.phi[i];
    readings_.dphi[i] = now.dphi[i];
    readings_.torque[i] = now.torque[i];
  }
  return readings_;
}

}  // namespace youbot_base_sim
