#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "youbot_base_sim/record/recorder.h"
#include "youbot_base_sim/ros/telemetry.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// Writes a bag inside the process that simulates: with the topics, frames and contents of base_node, stamped with
/// simulated time, and complete, which a recorder at the other end of a topic cannot promise. Needs no ROS master. The
/// file is written as NAME.part and renamed by `commit`; without that it is removed. Throws std::runtime_error, which
/// names the file, where the system refuses.
class BagWriter {
 public:
  explicit BagWriter(const std::string& path);
  ~BagWriter();
  BagWriter(const BagWriter&) = delete;
  BagWriter& operator=(const BagWriter&) = delete;

  /// Writes switches, in order of time.
  void write(const std::vector<RollerSwitch>& switches);

  /// Writes what the base tells about itself at time t (s), which is that of the others: the last update of
  /// `telemetry`, `simulation`, and its motors' `readings`.
  void write(const Telemetry& telemetry, const Simulation& simulation, const MotorReadings& readings, double t);

  /// Puts the bag in its place.
  void commit();

 private:
  class File;
  std::unique_ptr<File> file_;
};

/// The bag of a simulation whose motors exert its torque and tell what they do, without error unless the scene's motors
/// are `quantized`.
class BagRecorder : public Recorder {
 public:
  explicit BagRecorder(const std::string& path) : bag_(path) {}
  void write(double t, const Simulation& simulation, const std::vector<RollerSwitch>& switches) override;
  void commit() override { bag_.commit(); }

 private:
  BagWriter bag_;
  std::optional<MotorSensors> sensors_;
  std::optional<Telemetry> telemetry_;  // from the first row on
};

}  // namespace youbot_base_sim
