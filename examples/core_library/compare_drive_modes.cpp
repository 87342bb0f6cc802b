// One controller on both of the base's drive modes. It follows an arc to and fro while it turns, by where the base is,
// 50 times a second, and commands either the rates of the wheels, which the loops of the motors keep, or their torques:
// by the masses alone, or with the dry friction of the drives made up for.

#include <youbot_base_sim/drive/base_driver.h>
#include <youbot_base_sim/drive/driver_kinematics.h>
#include <youbot_base_sim/simulation.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

using namespace youbot_base_sim;
using Eigen::Array3d;

namespace {

constexpr double kPeriod = 0.02, kDuration = 16;  // s
constexpr double kGain = 4;                       // with rates, 1/s
constexpr double kStiffness = 64, kDamping = 16;  // with torques, 1/s^2 and 1/s

/// x, y (m) and heading (rad) that are wanted, and their derivatives, in the fixed frame.
struct Reference {
  Array3d pose, velocity, acceleration;
};

Reference reference(double t) {
  const Array3d size(0.5, 0.25, 0.4), rate = Array3d(1, 2, 1) * 2 * M_PI / 8;
  const Array3d c = (rate * t).cos(), s = (rate * t).sin();
  return {size * (1 - c), size * rate * s, size * rate * rate * c};
}

/// A vector of the fixed frame in that of the base.
Array3d in_base(const State& state, const Array3d& v) {
  const double c = std::cos(state.psi()), s = std::sin(state.psi());
  return {c * v[0] + s * v[1], c * v[1] - s * v[0], v[2]};
}

class Controller {
 public:
  enum Mode { kRates, kTorques, kTorquesAndFriction };

  Controller(Mode mode, const RobotParameters& robot) : mode_(mode), friction_(robot.dry_friction) {
    kinematics_.wheel_radius = robot.R;
    kinematics_.half_lengths = robot.h + robot.l;
    const double wheels = kWheels * robot.J_1 / (robot.R * robot.R), arm = robot.h + robot.l;
    inertia_ = {robot.m_s() + wheels, robot.m_s() + wheels, robot.I_s + wheels * arm * arm};
  }

  DriveCommand command(double t, const State& state) const {
    const Reference wanted = reference(t);
    const Array3d error = in_base(state, wanted.pose - Array3d(state.x(), state.y(), state.psi()));
    const Array3d velocity = in_base(state, wanted.velocity);
    if (mode_ == kRates) return to_all(DriveMode::kVelocity, kinematics_.wheel_rates(velocity + kGain * error));

    const Array3d acceleration =
        in_base(state, wanted.acceleration) + kDamping * (velocity - state.velocity().array()) + kStiffness * error;
    Wheels torque = (kinematics_.jacobian().transpose() * (inertia_ * acceleration).matrix()).array();  // virtual work
    if (mode_ == kTorquesAndFriction) torque += friction_ * (kinematics_.wheel_rates(velocity) / 0.2).tanh();
    return to_all(DriveMode::kTorque, torque);
  }

 private:
  static DriveCommand to_all(DriveMode mode, const Wheels& values) {
    DriveCommand command;
    for (int i = 0; i < kWheels; ++i) command[i] = SetPoint{mode, values[i]};
    return command;
  }

  Mode mode_;
  Wheels friction_;  // N m
  DriverKinematics kinematics_;
  Array3d inertia_;
};

void drive(const char* name, Controller::Mode mode, const Scene& scene) {
  BaseDriver::Settings settings;
  settings.control_period = scene.solver.control_period;
  BaseDriver driver(settings);
  const Controller controller(mode, scene.robot);
  Simulation simulation(scene);

  double squares = 0, largest = 0, slip = 0;
  const int steps = static_cast<int>(kDuration / kPeriod);
  for (int k = 0; k < steps; ++k) {
    driver.command(simulation.time(), controller.command(simulation.time(), simulation.state()));
    advance_to(simulation, (k + 1) * kPeriod, [&](double t, const State& x) { return driver.sample(t, x.dphi()); });
    const State& state = simulation.state();
    const Array3d wanted = reference(simulation.time()).pose;
    const double off = std::hypot(state.x() - wanted[0], state.y() - wanted[1]);
    squares += off * off;
    largest = std::max(largest, off);
    const ContactDetails contacts = simulation.contacts();
    slip = std::max(slip, (contacts.V_PX.square() + contacts.V_PY.square()).sqrt().maxCoeff());
  }
  std::printf("%-22s  off the path %5.1f mm rms, %5.1f mm at most; slip up to %.2f m/s\n", name,
              1e3 * std::sqrt(squares / steps), 1e3 * largest, slip);
}

}  // namespace

int main() {
  const Scene scene = default_scene({{"robot.profile", "measured"}, {"solver.control_period", 0.001}});
  drive("rates", Controller::kRates, scene);
  drive("torques", Controller::kTorques, scene);
  drive("torques and friction", Controller::kTorquesAndFriction, scene);
}
