#include "youbot_base_sim/ros/bag.h"

#include <fmt/format.h>
#include <ros/names.h>
#include <rosbag/bag.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>

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
    std::remove(part_.c_str());
  }

  template <class Message>
  void write(const std::string& topic, const ros::Time& stamp, const Message& message) {
    guarded("write", [&] { bag_->write(ros::names::append("/", topic), stamp, message); });
  }

  void commit() {
    guarded("write", [&] { bag_->close(); });
    if (std::rename(part_.c_str(), path_.c_str()) != 0) {
      throw std::runtime_error(fmt::format("{}: cannot rename it: {}", path_, std::strerror(errno)));
    }
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

}  // namespace youbot_base_sim
