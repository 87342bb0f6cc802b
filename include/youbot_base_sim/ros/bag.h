#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "youbot_base_sim/drive/control_time.h"
#include "youbot_base_sim/record/output_file.h"
#include "youbot_base_sim/record/recorder.h"
#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/ros/telemetry.h"
#include "youbot_base_sim/simulation.h"

namespace rosbag {
class Bag;
}

namespace youbot_base_sim {

constexpr double kBagMarkersRate = 25;  ///< Hz, at most: as smooth as a film, in bags of any rate

/// Writes a bag inside the process that simulates: topics, in a namespace, frames and contents of base_node, and
/// complete, which a recorder at the other end of a topic cannot promise. `stamp_at(t)` is the stamp of simulated time
/// t, s. Needs no ROS master.
///
/// The bag appears under its name with `commit`. Without it what was written is kept as NAME.incomplete-XXXXXX (see
/// OutputFile). Room for the index is reserved, so even on a full disk that file has its index and can be read. The
/// first write that finds no room ends the bag and throws OutputError, after which the writer must not be used. The
/// error says where the bag is, and if not even the index could be written, that it needs `rosbag reindex`.
class BagWriter {
 public:
  explicit BagWriter(OutputFile file, std::string ns = "/", std::function<ros::Time(double)> stamp_at = stamp_of)
      : file_(std::move(file)), namespace_(std::move(ns)), stamp_at_(std::move(stamp_at)) {}
  /// Keeps a bag that was not committed, see `keep_incomplete`.
  ~BagWriter() { keep_incomplete(); }
  BagWriter(const BagWriter&) = delete;
  BagWriter& operator=(const BagWriter&) = delete;

  /// Writes what happened since the last instant.
  void write(const Telemetry& telemetry, const Events& events);

  /// Writes the instant's topics of `telemetry` at time t (s), that of `simulation` and of the last update of
  /// `sensors`; contact markers at most at `kBagMarkersRate`.
  void write(Telemetry& telemetry, const Simulation& simulation, const BaseSensors& sensors, double t);

  /// Puts the bag in its place.
  void commit();

  /// Ends the bag early. Returns the name under which it is kept; empty if it has no messages.
  std::string keep_incomplete();

 private:
  template <class Message>
  void write(const TopicRow& topic, const ros::Time& stamp, Message message);
  template <class Action>
  void guarded(const Action& action);
  void open_bag();
  void make_room();
  [[noreturn]] void fail(const std::string& reason);
  bool close();

  OutputFile file_;
  std::string namespace_;
  std::function<ros::Time(double)> stamp_at_;
  std::shared_ptr<rosbag::Bag> bag_;
  std::uint64_t reserved_ = 0;                    // bytes
  std::map<std::string, std::uint32_t> numbers_;  // of the next message, by topic
  Instants markers_due_{kBagMarkersRate};
  bool has_static_ = false;  // transforms: they are written first
};

/// The bag of a simulation. Motor readings are exact unless the scene's motors are `quantized`.
std::unique_ptr<Recorder> bag_recorder(OutputFile file);

}  // namespace youbot_base_sim
