#include "youbot_robot_hw/test_bed.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace youbot_robot_hw {

using namespace youbot_base_sim;

namespace {

BaseDriver::Settings driver_settings(const Scene& scene) {
  if (!(scene.solver.control_period > 0)) throw std::invalid_argument("a test bed needs a scene with a control period");
  BaseDriver::Settings settings;
  settings.control_period = scene.solver.control_period;
  settings.motors = scene.motors.value_or(MotorSettings());
  return settings;
}

}  // namespace

TestBed::TestBed(const Scene& scene)
    : driver_(driver_settings(scene)),
      sensors_(driver_.motor(), driver_settings(scene).quantized(), scene.initial.phi()),
      simulation_(scene) {}

bool TestBed::command(const SetPoints& set_points) {
  bool finite = true;
  DriveCommand command;
  for (int i = 0; i < kWheels; ++i) {
    if (std::isfinite(set_points[i].value)) {
      command[i] = set_points[i];
    } else {
      finite = false;
    }
  }
  driver_.command(time(), command);
  return finite;
}

void TestBed::advance(double duration) {
  const double period = scene().solver.control_period, periods = std::round(duration / period);
  if (!(periods >= 1) || std::abs(periods * period - duration) > 1e-6 * period) {
    throw std::invalid_argument("a test bed advances by whole control periods of " + std::to_string(period) +
                                " s, not by " + std::to_string(duration) + " s");
  }
  for (int k = 0; k < periods; ++k) {
    simulation_.set_torque(driver_.sample(time(), state().dphi()));
    simulation_.step();
  }
}

}  // namespace youbot_robot_hw
