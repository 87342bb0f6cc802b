// Bags that are written without ROS running.

#include "youbot_base_sim/ros/bag.h"

#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <youbot_base_sim/RollerSwitchStamped.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <stdexcept>
#include <vector>

#include "errors.h"
#include "promises/small_disk.h"
#include "temporary_folder.h"
#include "youbot_base_sim/scene/frames.h"

namespace youbot_base_sim {
namespace {

OutputFile file_at(const std::string& path) { return OutputFile(path, OutputFile::Access::kAnywhere); }

/// A topic as a bag has it, of a base without a namespace.
std::string absolute(const std::string& topic) { return topic.front() == '/' ? topic : "/" + topic; }

/// The topics that have a message at each instant and are recorded, by `Telemetry`.
std::set<std::string> instant_topics(const Simulation& simulation, const Telemetry::Options& options,
                                     const BaseSensors::Options& of_sensors = {}) {
  const BaseSensors sensors(simulation.scene(), of_sensors);
  const Telemetry telemetry(simulation.scene(), options);
  std::set<std::string> topics;
  telemetry.visit(simulation, sensors, ros::Time(), [&](const TopicRow& topic, const auto&) {
    if (telemetry.is_requested(topic)) topics.insert(absolute(topic));
  });
  return topics;
}

Scene short_scene() { return load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case2.yaml"); }

TEST(BagWriter, writes_every_topic_and_every_switch) {
  const TemporaryFolder folder;
  Simulation simulation(short_scene());
  BagWriter bag(file_at(folder.path("x.bag")));
  BaseSensors sensors(simulation.scene(), {});
  Telemetry telemetry(simulation.scene(), {});
  std::size_t switches = 0;
  for (int k = 0; k <= 50; ++k) {
    simulation.advance_to(0.01 * k);
    const Events events = simulation.take_events();
    switches += events.switches.size();
    bag.write(telemetry, events);
    sensors.update(simulation.time(), simulation.state(), simulation.torque());
    bag.write(telemetry, simulation, sensors, simulation.time());
  }
  bag.commit();

  rosbag::Bag read(folder.path("x.bag"), rosbag::bagmode::Read);
  std::map<std::string, std::size_t> count;
  boost::shared_ptr<nav_msgs::Odometry> truth;
  std::string scene;
  rosbag::View view(read);
  for (const rosbag::MessageInstance& message : view) {
    ++count[message.getTopic()];
    if (message.getTopic() == "/ground_truth") truth = message.instantiate<nav_msgs::Odometry>();
    if (message.getTopic() == "/scene") scene = message.instantiate<std_msgs::String>()->data;
    if (message.getTopic() == "/base/roller_switches") {
      EXPECT_EQ(message.getTime(), message.instantiate<RollerSwitchStamped>()->header.stamp);
    }
  }
  EXPECT_GT(switches, 0u);
  std::map<std::string, std::size_t> expected = {{"/base/roller_switches", switches}, {"/scene", 1}};
  for (const std::string& topic : instant_topics(simulation, {})) expected[topic] = 51;
  EXPECT_GE(expected.size(), 5u);
  EXPECT_EQ(count, expected);
  EXPECT_EQ(view.getBeginTime(), ros::TIME_MIN);
  EXPECT_EQ(view.getEndTime(), ros::Time(0.5));
  EXPECT_EQ(truth->pose.pose.position.x, simulation.state().x());
  EXPECT_EQ(scene, provenance(simulation.scene()) + simulation.scene().resolved);
}

// The recorder of launch/recorder.xml names its topics: those that the table says are recorded, and commands.
TEST(LaunchedRecorder, has_the_recorded_topics) {
  std::set<std::string> topics = {absolute(kTwistTopic), absolute(kTorqueTopic), absolute(kVelocityTopic)};
  visit_topics([&](const TopicRow& topic) {
    if (topic.is(kRecorded)) topics.insert(absolute(topic.name));
  });
  EXPECT_TRUE(topics.erase(absolute(kJointStatesTopic)));
  topics.insert("/joint_states");  // so remapped by base.launch
  std::ifstream file(YOUBOT_BASE_SIM_SOURCE_DIR "/launch/recorder.xml");
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  const std::regex name("[ ']@?(/[a-z_/]+)");
  std::set<std::string> recorded;
  for (std::sregex_iterator found(text.begin(), text.end(), name), end; found != end; ++found) {
    recorded.insert((*found)[1]);
  }
  EXPECT_EQ(recorded, topics);
}

/// The bag of a run with a row every `period` (s) until `end` (s).
struct RecordedRun {
  RecordedRun(const Scene& scene, double period, double end) : simulation(scene) {
    const auto recorder = bag_recorder(file_at(folder.path("x.bag")));
    for (int k = 0; period * k <= end; ++k) {
      simulation.advance_to(period * k);
      recorder->write(period * k, simulation, simulation.take_events());
    }
    recorder->commit();
    bag.open(folder.path("x.bag"), rosbag::bagmode::Read);
  }

  template <class Message>
  std::vector<Message> messages(const std::string& topic) {
    std::vector<Message> found;
    for (const rosbag::MessageInstance& message : rosbag::View(bag, rosbag::TopicQuery(topic))) {
      found.push_back(*message.instantiate<Message>());
    }
    return found;
  }

  const TemporaryFolder folder;
  Simulation simulation;
  rosbag::Bag bag;
};

// As a publisher does: each topic from zero.
TEST(BagRecorder, numbers_its_messages) {
  Scene scene = short_scene();
  scene.contacts_in_bags = true;
  RecordedRun run(scene, 0.05, 1);
  const auto expect_numbered = [](const auto& messages, const std::string& topic) {
    EXPECT_GE(messages.size(), 10u) << topic;
    for (std::size_t k = 0; k < messages.size(); ++k) EXPECT_EQ(messages[k].header.seq, k) << topic;
  };
  for (const std::string topic : {"/odom", "/ground_truth"}) {
    expect_numbered(run.messages<nav_msgs::Odometry>(topic), topic);
  }
  expect_numbered(run.messages<sensor_msgs::JointState>("/base/joint_states"), "joint_states");
  expect_numbered(run.messages<ContactsStamped>("/contacts"), "contacts");
  expect_numbered(run.messages<RollerSwitchStamped>("/base/roller_switches"), "roller_switches");
}

TEST(BagRecorder, writes_contacts_on_request) {
  for (const bool asked : {false, true}) {
    Scene scene = short_scene();
    scene.contacts_in_bags = asked;
    RecordedRun run(scene, 0.5, 0.5);
    EXPECT_EQ(run.messages<visualization_msgs::MarkerArray>("/contact_markers").size(), asked ? 2u : 0u);
    const auto contacts = run.messages<ContactsStamped>("/contacts");
    ASSERT_EQ(contacts.size(), asked ? 2u : 0u);
    if (asked) {
      EXPECT_EQ(contacts[1].kinetic_energy, run.simulation.kinetic_energy());
    }
  }
}

// So that a bag that is played shows odometry and ground truth in one frame, to viewers that come later too.
TEST(BagRecorder, tells_where_odometry_starts_and_where_the_base_is) {
  RecordedRun run(short_scene(), 0.5, 0.5);
  rosbag::View fixed(run.bag, rosbag::TopicQuery("/tf_static"));
  ASSERT_EQ(fixed.size(), 1u);
  EXPECT_EQ((*fixed.begin()->getConnectionHeader())["latching"], "1");
  const auto start = fixed.begin()->instantiate<tf2_msgs::TFMessage>()->transforms.at(0);
  EXPECT_EQ(start.header.frame_id, "world");
  EXPECT_EQ(start.child_frame_id, "odom");
  EXPECT_EQ(start.transform.translation.x, 2.5);
  const auto truth = run.messages<tf2_msgs::TFMessage>("/tf").back().transforms.at(1);
  EXPECT_EQ(truth.child_frame_id, "ground_truth/base_footprint");
  EXPECT_EQ(truth.transform.translation.y, run.simulation.state().y());
}

// The push of the scene ends, and the load comes, between two rows: neither is lost, and the power of what pushes is
// the contacts' external power. The force keeps its direction in the fixed frame, in which the base turns.
TEST(BagRecorder, tells_what_the_base_carries_and_what_pushes_it) {
  const TemporaryFolder folder;
  RecordedRun run(load_scene(folder.write("scene.yaml",
                                          "duration: 1\noutput_rate: 10\noutput: {contacts: true}\n"
                                          "robot: {com: [0, 0]}\ninitial: {pose: [1, 2, 0.5]}\n"
                                          "loads: [{mass: 4, position: [0.1, 0.05, 0.2], inertia: 0.3, start: 0.43}]\n"
                                          "wrenches: [{force: [5, 3, -2], point: [0.1, -0.2, 0.4], torque: 1.5, "
                                          "start: 0.111, end: 0.768, frame: fixed}]\n")),
                  0.1, 1);
  std::map<ros::Time, nav_msgs::Odometry> truth;
  for (const auto& one : run.messages<nav_msgs::Odometry>("/ground_truth")) truth[one.header.stamp] = one;
  std::map<ros::Time, ContactsStamped> contacts;
  for (const auto& one : run.messages<ContactsStamped>("/contacts")) contacts[one.header.stamp] = one;
  const auto wrenches = run.messages<geometry_msgs::WrenchStamped>("/applied_wrench");
  ASSERT_EQ(wrenches.size(), 8u);  // where it begins and ends, and at six rows between
  EXPECT_EQ(wrenches.front().header.stamp, ros::Time(0.111));
  EXPECT_EQ(wrenches.back().header.stamp, ros::Time(0.768));
  EXPECT_EQ(wrenches.back().wrench.force.x, 0);
  const auto& first = wrenches.front();
  EXPECT_EQ(first.header.frame_id, "base_link");
  EXPECT_NEAR(first.wrench.force.x, 5 * std::cos(0.5) + 3 * std::sin(0.5), 1e-9);
  EXPECT_NEAR(first.wrench.force.y, 3 * std::cos(0.5) - 5 * std::sin(0.5), 1e-9);
  const double height = 0.4 + kAxleHeight;  // of the point over base_link
  EXPECT_NEAR(first.wrench.torque.x, -0.2 * -2 - height * first.wrench.force.y, 1e-9);
  int compared = 0;
  for (const auto& [header, wrench] : wrenches) {
    if (contacts.count(header.stamp) == 0) continue;
    const geometry_msgs::Twist& twist = truth.at(header.stamp).twist.twist;
    const double power =
        wrench.force.x * twist.linear.x + wrench.force.y * twist.linear.y + wrench.torque.z * twist.angular.z;
    EXPECT_NEAR(power, contacts.at(header.stamp).external_power, 1e-9);
    EXPECT_NE(power, 0);
    ++compared;
  }
  EXPECT_EQ(compared, 6);
  const auto loads = run.messages<LoadsStamped>("/loads");
  ASSERT_EQ(loads.size(), 1u);
  EXPECT_EQ(loads[0].header.stamp, ros::Time(0.43));
  EXPECT_EQ(loads[0].loads.at(0).mass, 4);
  EXPECT_NEAR(loads[0].loads.at(0).position.z, 0.2 + kAxleHeight, 1e-12);
  EXPECT_EQ(loads[0].loads.at(0).inertia, 0.3);
}

// An inertial unit that is not in the middle of the base has a frame of its own, with the robot's prefix.
TEST(BagWriter, places_the_inertial_unit) {
  const Simulation simulation(short_scene());
  BaseSensors::Options of_sensors;
  of_sensors.imu.emplace();
  Telemetry::Options options;
  options.frames = FrameNames::of("robot", "odom", "base_footprint", "world");
  const Telemetry telemetry(simulation.scene(), options);
  const auto frame_of = [&](const BaseSensors& sensors) {
    std::string frame;
    telemetry.visit(simulation, sensors, ros::Time(1), [&](const TopicRow&, const auto& make) {
      if constexpr (std::is_same_v<std::decay_t<decltype(make())>, sensor_msgs::Imu>) frame = make().header.frame_id;
    });
    return frame;
  };
  const BaseSensors middle(simulation.scene(), of_sensors);
  EXPECT_EQ(frame_of(middle), "robot/base_footprint");
  EXPECT_TRUE(telemetry.static_transforms(simulation, middle, ros::Time(1)).transforms.empty());

  of_sensors.imu->position = {0.2, -0.1, 0.05};
  const BaseSensors apart(simulation.scene(), of_sensors);
  EXPECT_EQ(frame_of(apart), "robot/imu_link");
  const auto transforms = telemetry.static_transforms(simulation, apart, ros::Time(1)).transforms;
  ASSERT_EQ(transforms.size(), 1u);
  EXPECT_EQ(transforms[0].header.frame_id, "robot/base_link");
  EXPECT_EQ(transforms[0].child_frame_id, "robot/imu_link");
  EXPECT_EQ(vector_of(transforms[0].transform.translation), Eigen::Vector3d(0.2, -0.1, 0.05));
  EXPECT_EQ(transforms[0].transform.rotation.w, 1);
}

// robot_state_publisher warns of joints that its URDF does not have.
TEST(Telemetry, leaves_out_the_casters) {
  const Simulation simulation(short_scene());
  Telemetry::Options options;
  options.casters = false;
  options.rollers = true;
  const Telemetry telemetry(simulation.scene(), options);
  sensor_msgs::JointState joints;
  telemetry.visit(simulation, BaseSensors(simulation.scene(), {}), ros::Time(1),
                  [&](const TopicRow&, const auto& make) {
                    if constexpr (std::is_same_v<std::decay_t<decltype(make())>, sensor_msgs::JointState>)
                      joints = make();
                  });
  ASSERT_EQ(joints.name.size(), 4u + 4u * 6u);
  EXPECT_EQ(joints.name[3], "wheel_joint_br");
  EXPECT_EQ(joints.name[4], "roller_joint_fl_0");
  EXPECT_EQ(joints.name.back(), "roller_joint_br_5");
  for (int i = 0; i < kWheels; ++i) {
    const int on_floor = 4 + 6 * i + simulation.rollers()[i];
    EXPECT_EQ(joints.position[on_floor], simulation.roller_angle(i, simulation.rollers()[i]));
  }
}

/// Writes what the base tells at t (s) of a simulation that stands still.
void write_at(double t, const Simulation& simulation, BagWriter& bag) {
  const BaseSensors sensors(simulation.scene(), {});
  Telemetry telemetry(simulation.scene(), {});
  bag.write(telemetry, simulation, sensors, t);
}

std::vector<std::string> files(const TemporaryFolder& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path("")))
    names.push_back(entry.path().filename());
  return names;
}

/// Messages in the bag, by its index.
std::uint32_t messages(const std::string& path) {
  rosbag::Bag bag(path, rosbag::bagmode::Read);
  return rosbag::View(bag).size();
}

TEST(BagWriter, keeps_a_bag_that_is_not_committed_under_a_name_that_tells) {
  const TemporaryFolder folder;
  const Simulation simulation(short_scene());
  {
    BagWriter bag(file_at(folder.path("x.bag")));
    write_at(0, simulation, bag);
    BagWriter empty(file_at(folder.path("y.bag")));
  }
  ASSERT_EQ(files(folder).size(), 1u);
  EXPECT_EQ(files(folder)[0].find("x.bag.incomplete-"), 0u);
  EXPECT_EQ(messages(folder.path(files(folder)[0])), 1 + instant_topics(simulation, {}).size());
}

TEST(BagWriter, a_bag_without_messages_is_a_bag) {
  const TemporaryFolder folder;
  BagWriter(file_at(folder.path("x.bag"))).commit();
  EXPECT_EQ(files(folder), std::vector<std::string>{"x.bag"});
  EXPECT_EQ(messages(folder.path("x.bag")), 0u);
}

TEST(BagWriter, on_a_full_disk_keeps_all_messages_so_far_with_their_index) {
  const TemporaryFolder folder;
  const Simulation simulation(short_scene());
  std::optional<FileSizeLimit> limit(4 << 20);
  std::uint32_t instants = 0;
  const std::string error = error_of<OutputError>([&] {
    BagWriter bag(file_at(folder.path("x.bag")));
    for (; instants < 20000; ++instants) write_at(1e-3 * instants, simulation, bag);
  });
  limit.reset();
  ASSERT_EQ(files(folder).size(), 1u);
  expect_words(error, {"no space", files(folder)[0]});
  const std::string kept = folder.path(files(folder)[0]);
  EXPECT_GT(std::filesystem::file_size(kept), 3u << 20);
  const std::size_t topics = instant_topics(simulation, {}).size();
  EXPECT_GE(messages(kept), 1 + topics * instants);
  EXPECT_LT(messages(kept), 1 + topics * (instants + 1));
}

TEST(BagWriter, says_so_if_not_even_the_index_finds_room) {
  const TemporaryFolder folder;
  const Simulation simulation(short_scene());
  BagWriter bag(file_at(folder.path("x.bag")));
  for (int k = 0; k < 300; ++k) write_at(1e-3 * k, simulation, bag);
  std::optional<FileSizeLimit> limit(64 << 10);
  const std::string kept = bag.keep_incomplete();
  limit.reset();
  expect_words(kept, {"x.bag.incomplete-", "rosbag reindex"});
}

}  // namespace
}  // namespace youbot_base_sim
