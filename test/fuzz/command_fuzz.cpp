// Messages and services to the base driver in any order, with any numbers, names and units: set points stay within the
// motor's limits, and the base keeps a finite state.

#include "fuzz.h"
#include "youbot_base_sim/loop/base_requests.h"
#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/sensors/motor_sensors.h"

using namespace youbot_base_sim;

namespace {

/// Takes what it needs from the input; zeros after its end.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}
  bool empty() const { return left_ == 0; }

  std::uint8_t byte() {
    std::uint8_t value = 0;
    take(&value, 1);
    return value;
  }

  /// Any double, which may be infinite or not a number.
  double number() {
    double value = 0;
    take(&value, sizeof(value));
    return value;
  }

  double from_0_to(double max) { return max * byte() / 255; }

  /// One of `known`, or up to 15 bytes of the input.
  template <std::size_t size>
  std::string text(const char* const (&known)[size]) {
    const std::size_t choice = byte() % (size + 1);
    if (choice < size) return known[choice];
    std::string text(byte() % 16, ' ');
    take(text.data(), text.size());
    return text;
  }

 private:
  void take(void* to, std::size_t size) {
    const std::size_t taken = std::min(size, left_);
    std::memcpy(to, data_, taken);
    data_ += taken;
    left_ -= taken;
  }

  const std::uint8_t* data_;
  std::size_t left_;
};

std::vector<brics_actuator::JointValue> entries(Input& input) {
  constexpr const char* kJoints[] = {"wheel_joint_fl", "wheel_joint_fr", "wheel_joint_bl", "wheel_joint_br",
                                     "arm_joint_1"};
  constexpr const char* kUnits[] = {kTorqueUnit, kVelocityUnit};
  std::vector<brics_actuator::JointValue> entries(input.byte() % 8);
  for (auto& entry : entries) {
    entry.joint_uri = input.text(kJoints);
    entry.unit = input.text(kUnits);
    entry.value = input.number();
  }
  return entries;
}

DriveCommand checked(const WheelCommand& command) {
  for (const auto& set_point : command.set_points) {
    require(!set_point || std::isfinite(set_point->value), "a set point is finite");
  }
  require(command.complaints.size() <= 8, "no more complaints than entries");
  for (const Complaint& complaint : command.complaints) {
    require_one_line(complaint.subject);
    require_one_line(complaint.text);
  }
  return command.set_points;
}

Faults faults(Input& input) {
  Faults faults;  // within what ~set_faults accepts
  const std::uint8_t bits = input.byte();
  faults.ethercat_lost = bits & 1;
  for (int i = 0; i < kWheels; ++i) {
    faults.silent[i] = bits >> i & 2;
    faults.encoder_slip[i] = input.from_0_to(1);
  }
  faults.encoder_noise = input.from_0_to(10);
  faults.command_delay = input.from_0_to(60);
  return faults;
}

BaseRequest request(Input& input, const DriverKinematics& kinematics) {
  switch (input.byte() % 7) {
    case 0: {
      brics_actuator::JointTorques message;
      message.torques = entries(input);
      return checked(wheel_command(message));
    }
    case 1: {
      brics_actuator::JointVelocities message;
      message.velocities = entries(input);
      return checked(wheel_command(message));
    }
    case 2: {
      geometry_msgs::Twist message;
      message.linear.x = input.number();
      message.linear.y = input.number();
      message.angular.z = input.number();
      return checked(wheel_command(message, kinematics));
    }
    case 3:
      return SwitchOff();
    case 4:
      return SwitchOn();
    case 5:
      return Reconnect();
    default:
      return faults(input);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr double kPeriod = 1e-3;      // s
  constexpr double kDryFriction = 0.7;  // N m
  Scene scene;
  scene.solver.control_period = kPeriod;
  scene.solver.relative_tolerance = 1e-3;
  scene.duration = 1;
  BaseDriver::Settings settings;
  settings.control_period = kPeriod;

  Input input(data, size);
  const std::uint8_t variant = input.byte();
  settings.motors.quantized = variant & 1;
  scene.robot.dry_friction.setConstant(variant & 2 ? kDryFriction : 0);
  settings.command_timeout = variant & 4 ? 2 * kPeriod : 0;
  BaseDriver driver(settings);
  MotorSensors sensors(driver.motor(), settings.quantized(), Wheels::Zero());
  BaseRequests requests{ControlTime(kPeriod)};
  Simulation simulation(scene);
  const auto drive = [&](double t, const State& state) {
    requests.take(t, driver);
    const Wheels torque = driver.sample(t, state.dphi());
    require((torque.abs() <= driver.motor().max_torque()).all(), "torques are limited");
    for (const SetPoint& set_point : driver.set_points()) {
      require(driver.motor().can(set_point), fmt::format("set point {} is within the limits", set_point.value));
    }
    return torque;
  };
  for (int k = 0; k < 20 && !input.empty(); ++k) {
    for (int n = input.byte() % 4; n > 0; --n) {
      const double arrival = simulation.time() + input.from_0_to(2 * kPeriod);
      requests.push(arrival, request(input, DriverKinematics()));
    }
    simulation.set_torque(drive(simulation.time(), simulation.state()));
    simulation.step();
    require_finite(simulation.state().values, "the state");
    const MotorReadings& readings =
        sensors.read(simulation.state().phi(), simulation.state().dphi(), driver.torque(), driver.faults());
    require_finite(readings.phi, "an angle");
    require_finite(readings.dphi, "a rate");
    require_finite(readings.torque, "an effort");
    driver.take_events();
  }
  return 0;
}
