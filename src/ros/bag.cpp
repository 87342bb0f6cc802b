#include "youbot_base_sim/ros/bag.h"

#include <fmt/format.h>
#include <ros/names.h>
#include <rosbag/bag.h>

#include <boost/make_shared.hpp>
#include <cerrno>
#include <cstdint>
#include <exception>
#include <map>
#include <mutex>
#include <utility>

namespace youbot_base_sim {

namespace {

// A bag loads a plugin when it is made and gives it back when it is deleted, which no two threads may do at once.
std::mutex bag_plugins;

struct DeleteBag {
  void operator()(rosbag::Bag* bag) const {
    const std::lock_guard<std::mutex> lock(bag_plugins);
    delete bag;
  }
};
using BagPointer = std::unique_ptr<rosbag::Bag, DeleteBag>;

BagPointer make_bag() {
  const std::lock_guard<std::mutex> lock(bag_plugins);
  return BagPointer(new rosbag::Bag);
}

}  // namespace

class BagWriter::File {
 public:
  explicit File(OutputFile file) : file_(std::move(file)) {}
  ~File() { keep_incomplete(); }

  /// Numbers the messages of each topic in their header, as a publisher would.
  template <class Message>
  void write(const std::string& topic, const ros::Time& stamp, Message message,
             const boost::shared_ptr<ros::M_string>& connection = {}) {
    if (auto* header = ros::message_traits::header(message)) header->seq = numbers_[topic]++;
    guarded([&] {
      if (!bag_) open();
      make_room();
      bag_->write(ros::names::append("/", topic), stamp, message, connection);
    });
  }

  void commit() {
    guarded([&] {
      if (!bag_) open();
      bag_->close();
    });
    bag_.reset();
    file_.commit();
  }

  std::string keep_incomplete() {
    const bool indexed = close();
    const std::string name = file_.keep_incomplete();
    return indexed || name.empty() ? name : name + kNotIndexed;
  }

 private:
  static constexpr char kNotIndexed[] = " without its index, which rosbag reindex makes";
  // bytes: room for a message, the index of the chunk under way and the connections, a share for the list of chunks;
  // and how much of the disk is taken at a time, where it has that much.
  static constexpr std::uint64_t kRoom = 256 << 10, kRoomShare = 1000, kStride = 4 << 20;

  // Not before the first message, so that nothing is left where there is none, nor where it has no room.
  void open() {
    make_room();
    bag_ = make_bag();
    bag_->open(file_.name(), rosbag::bagmode::Write);
    reserved_ = 0;  // given back: rosbag empties the file
  }

  void make_room() {
    const std::uint64_t size = bag_ ? bag_->getSize() : 0, needed = size + size / kRoomShare + kRoom;
    if (needed <= reserved_) return;
    reserved_ = needed + kStride;
    if (file_.reserve(reserved_) == 0) return;
    reserved_ = needed;
    if (const int error = file_.reserve(reserved_)) fail(OutputFile::text_of(error));
  }

  [[noreturn]] void fail(const std::string& reason) {
    const bool indexed = close();
    file_.fail(reason, indexed ? "" : kNotIndexed);
  }

  // Writes the index. Returns whether that succeeded.
  bool close() {
    if (!bag_) return true;
    try {
      bag_->close();
      bag_.reset();
      return true;
    } catch (const ros::Exception&) {
      // Its destructor would throw the same again, so it stays until the program ends.
      static auto* const unclosed = new std::vector<rosbag::Bag*>;
      unclosed->push_back(bag_.release());
      return false;
    }
  }

  // rosbag's exceptions do not contain the system's reason.
  template <class Action>
  void guarded(Action&& action) {
    errno = 0;
    try {
      action();
    } catch (const ros::Exception& exception) {
      fail(errno ? OutputFile::text_of(errno) : exception.what());
    }
  }

  OutputFile file_;
  BagPointer bag_;
  std::uint64_t reserved_ = 0;                    // bytes
  std::map<std::string, std::uint32_t> numbers_;  // of the next message, by topic
};

namespace {

/// Connection header of a latched topic: `rosbag play` gives its last message to later subscribers.
template <class Message>
boost::shared_ptr<ros::M_string> latched(const Message& message) {
  namespace traits = ros::message_traits;
  return boost::make_shared<ros::M_string>(ros::M_string{{"type", traits::datatype(message)},
                                                         {"md5sum", traits::md5sum(message)},
                                                         {"message_definition", traits::definition(message)},
                                                         {"latching", "1"}});
}

}  // namespace

BagWriter::BagWriter(OutputFile file) : file_(std::make_unique<File>(std::move(file))) {}

BagWriter::~BagWriter() = default;

void BagWriter::write(const Events& events) {
  for (const RollerSwitch& event : events.switches) {
    const ros::Time stamp = stamp_of(event.t);
    file_->write(kRollerSwitchesTopic, stamp, roller_switch_message(event, stamp));
  }
  for (const LoadChange& change : events.load_changes) {
    const ros::Time stamp = stamp_of(change.t);
    Telemetry::visit(change, stamp, [&](const char* topic, const auto& make) {
      const auto message = make();
      file_->write(topic, stamp, message, latched(message));
    });
  }
}

void BagWriter::write(const Telemetry& telemetry, const Simulation& simulation, const BaseSensors& sensors, double t) {
  const ros::Time stamp = stamp_of(t);
  if (!std::exchange(has_static_, true)) {
    const auto transforms = telemetry.static_transforms(simulation, stamp);
    if (transforms) file_->write(kStaticTransformsTopic, stamp, *transforms, latched(*transforms));
  }
  telemetry.visit(simulation, sensors, stamp, [&](const char* topic, const auto& make) {
    if (telemetry.recorded(topic)) file_->write(topic, stamp, make());
  });
  Telemetry::visit_push(simulation, stamp, [&](const char* topic, const auto& make) {
    const auto message = make();
    file_->write(topic, stamp, message, latched(message));
  });
}

void BagWriter::write(visualization_msgs::MarkerArray markers, double t) {
  file_->write(kContactMarkersTopic, stamp_of(t), std::move(markers));
}

void BagWriter::commit() { file_->commit(); }

std::string BagWriter::keep_incomplete() { return file_->keep_incomplete(); }

void BagRecorder::write(double t, const Simulation& simulation, const Events& events) {
  const State& state = simulation.state();
  if (!motors_) motors_.emplace(simulation.scene().motors, state.phi());
  const MotorReadings& readings = motors_->read(state.phi(), state.dphi(), simulation.torque());
  if (sensors_) {
    sensors_->update(t, state, readings);
  } else {
    Telemetry::Options options;
    options.contacts = simulation.scene().output.contacts;
    options.world = true;
    sensors_.emplace(simulation.scene(), readings, BaseSensors::Options());
    telemetry_.emplace(simulation.scene(), options);
    if (options.contacts) markers_.emplace(marker_options(simulation.scene().robot, options.world));
  }
  bag_.write(events);
  bag_.write(*telemetry_, simulation, *sensors_, t);
  if (!markers_) return;
  bag_.write_markers(t, [&] { return markers_->at(contacts_message(simulation, stamp_of(t)), simulation); });
}

}  // namespace youbot_base_sim
