#include "youbot_base_sim/ros/bag.h"

#include <fmt/format.h>
#include <ros/names.h>
#include <rosbag/bag.h>

#include <filesystem>
#include <stdexcept>
#include <system_error>

namespace youbot_base_sim {

class BagWriter::File {
 public:
  explicit File(const std::string& path) : path_(path), part_(path + ".part"), bag_(std::make_unique<rosbag::Bag>()) {
    guarded("open", [&] { bag_->open(part_, rosbag::bagmode::Write); });
  }

  ~File() {
    if (!bag_) return;
    try {
      bag_->close();
    } catch (const std::exception&) {
      static_cast<void>(bag_.release());  // its destructor would throw the same again
    }
    std::error_code ignored;
    std::filesystem::remove(part_, ignored);
  }

  template <class Message>
  void write(const std::string& topic, const ros::Time& stamp, const Message& message) {
    guarded("write", [&] { bag_->write(ros::names::append("/", topic), stamp, message); });
  }

  void commit() {
    guarded("write", [&] { bag_->close(); });
    std::error_code error;
    std::filesystem::rename(part_, path_, error);
    if (error) throw std::runtime_error(fmt::format("{}: cannot rename it: {}", path_, error.message()));
    bag_.reset();
  }

 private:
  template <class Action>
  void guarded(const char* doing, Action&& action) const {
    try {
      action();
    } catch (const ros::Exception& error) {
      throw std::runtime_error(fmt::format("{}: cannot {} it: {}", path_, doing, error.what()));
    }
  }

  std::string path_;
  std::string part_;
  std::unique_ptr<rosbag::Bag> bag_;
};

BagWriter::BagWriter(const std::string& path) : file_(std::make_unique<File>(path)) {}

BagWriter::~BagWriter() = default;

void BagWriter::write(const std::vector<RollerSwitch>& switches) {
  for (const RollerSwitch& event : switches) {
    const ros::Time stamp = stamp_of(event.t);
    file_->write(kRollerSwitchesTopic, stamp, roller_switch_message(event, stamp));
  }
}

void BagWriter::write(const Telemetry& telemetry, const Simulation& simulation, const MotorReadings& readings,
                      double t) {
  const ros::Time stamp = stamp_of(t);
  telemetry.visit(simulation, readings, stamp,
                  [&](const char* topic, const auto& make) { file_->write(topic, stamp, make()); });
}

void BagWriter::commit() { file_->commit(); }

void BagRecorder::write(double t, const Simulation& simulation, const std::vector<RollerSwitch>& switches) {
  const State& state = simulation.state();
  if (!sensors_) {
    const std::optional<MotorSettings>& motors = simulation.scene().motors;
    sensors_.emplace(Motor(), motors && motors->quantized.value_or(false), state.phi());
  }
  const MotorReadings& readings = sensors_->read(state.phi(), state.dphi(), simulation.torque());
  if (telemetry_) {
    telemetry_->update(readings.phi);
  } else {
    telemetry_.emplace(simulation.scene().robot.rollers, readings.phi, Telemetry::Options());
  }
  bag_.write(switches);
  bag_.write(*telemetry_, simulation, readings, t);
}

}  // namespace youbot_base_sim
