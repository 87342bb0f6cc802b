#include "youbot_base_sim/ros/bag.h"

#include <ros/names.h>
#include <rosbag/bag.h>

#include <boost/make_shared.hpp>
#include <cerrno>
#include <mutex>
#include <optional>
#include <vector>

namespace youbot_base_sim {

namespace {

constexpr char kNotIndexed[] = " without its index, which rosbag reindex makes";
// bytes: room for a message, the index of the chunk under way and the connections; a share for the list of chunks; and
// how much of the disk is taken at a time, if it has that much.
constexpr std::uint64_t kRoom = 256 << 10, kRoomShare = 1000, kStride = 4 << 20;

// A bag's constructor loads a plugin and its destructor unloads it: one thread at a time.
std::mutex bag_plugins;

/// Connection header of a latched topic: `rosbag play` gives its last message to later subscribers.
template <class Message>
boost::shared_ptr<ros::M_string> latching(const Message& message) {
  namespace traits = ros::message_traits;
  return boost::make_shared<ros::M_string>(ros::M_string{{"type", traits::datatype(message)},
                                                         {"md5sum", traits::md5sum(message)},
                                                         {"message_definition", traits::definition(message)},
                                                         {"latching", "1"}});
}

}  // namespace

// Called with the first message, so that a bag without one, or without room for it, leaves nothing.
void BagWriter::open_bag() {
  make_room();
  const std::lock_guard<std::mutex> lock(bag_plugins);
  bag_.reset(new rosbag::Bag, [](rosbag::Bag* bag) {
    const std::lock_guard<std::mutex> lock_to_delete(bag_plugins);
    delete bag;
  });
  bag_->open(file_.name(), rosbag::bagmode::Write);
  reserved_ = 0;  // given back: rosbag empties the file
}

void BagWriter::make_room() {
  const std::uint64_t size = bag_ ? bag_->getSize() : 0, needed = size + size / kRoomShare + kRoom;
  if (needed <= reserved_) return;
  reserved_ = needed + kStride;
  if (file_.reserve(reserved_) == 0) return;
  reserved_ = needed;
  if (const int error = file_.reserve(reserved_)) fail(OutputFile::text_of(error));
}

void BagWriter::fail(const std::string& reason) {
  const bool indexed = close();
  file_.fail(reason, indexed ? "" : kNotIndexed);
}

/// Writes the index. Returns whether that succeeded.
bool BagWriter::close() {
  if (!bag_) return true;
  try {
    bag_->close();
    bag_.reset();
    return true;
  } catch (const ros::Exception&) {
    // Its destructor would throw the same again, so it stays until the program ends.
    static auto* const unclosed = new std::vector<std::shared_ptr<rosbag::Bag>>;
    unclosed->push_back(std::move(bag_));
    return false;
  }
}

/// rosbag's exceptions do not contain the system's reason.
template <class Action>
void BagWriter::guarded(const Action& action) {
  errno = 0;
  try {
    if (!bag_) open_bag();
    action();
  } catch (const ros::Exception& exception) {
    fail(errno ? OutputFile::text_of(errno) : exception.what());
  }
}

/// Numbers the messages of each topic in their header, as a publisher would.
template <class Message>
void BagWriter::write(const TopicRow& topic, const ros::Time& stamp, Message message) {
  if (!topic.is(kRecorded)) return;
  const std::string name = *topic.name == '/' ? topic.name : ros::names::append(namespace_, topic);
  if (auto* header = ros::message_traits::header(message)) header->seq = numbers_[topic]++;
  guarded([&] {
    make_room();
    bag_->write(name, stamp, message, topic.is(kLatched) ? latching(message) : nullptr);
  });
}

void BagWriter::write(const Telemetry& telemetry, const Events& events) {
  telemetry.visit(events, stamp_at_, [this](const TopicRow& topic, const ros::Time& stamp, const auto& make) {
    write(topic, stamp, make());
  });
}

void BagWriter::write(Telemetry& telemetry, const Simulation& simulation, const BaseSensors& sensors, double t) {
  const ros::Time stamp = stamp_at_(t);
  if (!std::exchange(has_static_, true)) {
    write(kSceneTopic, stamp, scene_message(simulation.scene()));
    const tf2_msgs::TFMessage transforms = telemetry.static_transforms(simulation, sensors, stamp);
    if (!transforms.transforms.empty()) write(kStaticTransformsTopic, stamp, transforms);
  }
  telemetry.visit(simulation, sensors, stamp, [&](const TopicRow& topic, const auto& make) {
    if (telemetry.is_requested(topic)) write(topic, stamp, make());
  });
  if (telemetry.is_requested(kContactMarkersTopic) && markers_due_.meet(t)) {
    write(kContactMarkersTopic, stamp, telemetry.markers(simulation, stamp));
  }
}

void BagWriter::commit() {
  guarded([&] { bag_->close(); });
  bag_.reset();
  file_.commit();
}

std::string BagWriter::keep_incomplete() {
  const bool indexed = close();
  const std::string name = file_.keep_incomplete();
  return indexed || name.empty() ? name : name + kNotIndexed;
}

namespace {

class BagRecorder : public Recorder {
 public:
  explicit BagRecorder(OutputFile file) : bag_(std::move(file)) {}
  void write(double t, const Simulation& simulation, const Events& events) override;
  void commit() override { bag_.commit(); }
  std::string keep_incomplete() override { return bag_.keep_incomplete(); }

 private:
  BagWriter bag_;
  std::optional<BaseSensors> sensors_;  // from the first row on
  std::optional<Telemetry> telemetry_;  // the same
};

void BagRecorder::write(double t, const Simulation& simulation, const Events& events) {
  const Scene& scene = simulation.scene();
  if (!sensors_) {
    Telemetry::Options options;
    options.contacts = scene.contacts_in_bags;
    options.world = true;
    options.markers = marker_options(scene.robot, options.world);
    sensors_ = BaseSensors::of(scene);
    telemetry_.emplace(scene, options);
  }
  sensors_->update(t, simulation.state(), simulation.torque());
  bag_.write(*telemetry_, events);
  bag_.write(*telemetry_, simulation, *sensors_, t);
}

}  // namespace

std::unique_ptr<Recorder> bag_recorder(OutputFile file) { return std::make_unique<BagRecorder>(std::move(file)); }

}  // namespace youbot_base_sim
