#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/WrenchStamped.h>
#include <nav_msgs/Odometry.h>
#ifdef YOUBOT_BASE_SIM_PR2_MSGS
#include <pr2_msgs/PowerBoardState.h>
#endif
#include <rosgraph_msgs/Clock.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/String.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/MarkerArray.h>
#include <youbot_base_sim/ContactsStamped.h>
#include <youbot_base_sim/LoadsStamped.h>
#include <youbot_base_sim/RollerSwitchStamped.h>

#include <cstdint>
#include <string>
#include <tuple>

/// The topics of the node. Names are relative to its namespace, as those of the driver, unless they begin with a slash.
///
/// A new topic is
/// 1. a row here and its name in `kTopics`: advertising and bags follow. Not `kTelemetry`, `kAwaited`: stacks wait;
/// 2. a function of ros/conversions that makes its message; for a type of its own, msg/ and its name in CMakeLists.txt;
/// 3. a line of a `Telemetry::visit` (ros/telemetry.h): that of instants, or that of events, sent where
///    `kAtInstants`, `kAtPeriods` stop the loop. BaseNode publishes what does not change, markers and diagnostics;
/// 4. for a new list of `Events` (simulation.h), which counts in `any`, first CONTRIBUTING's row of it;
/// 5. a line of launch/recorder.xml, if it is `kRecorded`: bag_test compares;
/// 6. a row in docs/node.md; the list of bags in docs/outputs.md; `~wait_for_subscribers` in docs/node/parameters.csv.
namespace youbot_base_sim {

// Commands. The driver has no topics for single wheels; these are named by analogy to the arm's.
constexpr char kTwistTopic[] = "cmd_vel";
constexpr char kTorqueTopic[] = "base/base_controller/torques_command";
constexpr char kWrenchTopic[] = "wrench";            // private
constexpr char kInitialPoseTopic[] = "initialpose";  // as amcl's: rviz's "2D Pose Estimate"
constexpr char kVelocityTopic[] = "base/base_controller/velocity_command";

constexpr std::uint32_t kCommandQueueSize = 1000;   ///< of subscribers, as the driver's
constexpr std::uint32_t kDriverQueueSize = 1;       ///< of publishers, as the driver's: the latest message counts
constexpr std::uint32_t kRecorderQueueSize = 1000;  ///< of publishers whose every message counts

/// Properties of a topic, one bit each.
enum TopicProperty : unsigned {
  kLatched = 1 << 0,     ///< later subscribers get the last message
  kRecorded = 1 << 1,    ///< bags and launch/recorder.xml have it
  kAwaited = 1 << 2,     ///< with `~wait_for_subscribers`, time waits for its subscriber
  kOnRequest = 1 << 3,   ///< recorded and awaited only with `~publish_contacts`
  kAtInstants = 1 << 4,  ///< a subscriber has the loop stop at each instant of publishing
  kAtPeriods = 1 << 5,   ///< a subscriber stops a loop that is not paced after each control period
  kOfDriver = 1 << 6,    ///< not published while the driver has no base, as after a loss of EtherCAT; `~bag` goes on
};

/// A topic without its type.
struct TopicRow {
  const char* name;
  std::uint32_t queue_size;  ///< of the publisher; 0: that of the clock, see NodeClock
  unsigned properties;

  constexpr bool is(TopicProperty property) const { return (properties & property) != 0; }
  operator std::string() const { return name; }  // NOLINT(google-explicit-constructor)
};

template <class Message>
struct Topic : TopicRow {};

constexpr unsigned kTelemetry = kRecorded | kAwaited | kAtInstants;  ///< most of what is awaited at each instant

inline constexpr Topic<nav_msgs::Odometry> kOdometryTopic{{"odom", 0, kTelemetry | kOfDriver}};
inline constexpr Topic<nav_msgs::Odometry> kGroundTruthTopic{{"ground_truth", 0, kTelemetry}};
inline constexpr Topic<sensor_msgs::JointState> kJointStatesTopic{{"base/joint_states", 0, kTelemetry | kOfDriver}};
inline constexpr Topic<sensor_msgs::Imu> kImuTopic{{"imu/data", 0, kTelemetry}};
inline constexpr Topic<tf2_msgs::TFMessage> kTransformsTopic{{"/tf", 0, kTelemetry | kOfDriver}};
inline constexpr Topic<tf2_msgs::TFMessage> kStaticTransformsTopic{
    {"/tf_static", kRecorderQueueSize, kRecorded | kLatched}};
inline constexpr Topic<ContactsStamped> kContactsTopic{{"contacts", 0, kTelemetry | kOnRequest}};
inline constexpr Topic<visualization_msgs::MarkerArray> kContactMarkersTopic{
    {"contact_markers", kDriverQueueSize, kRecorded | kOnRequest | kAtInstants}};
inline constexpr Topic<RollerSwitchStamped> kRollerSwitchesTopic{
    {"base/roller_switches", kRecorderQueueSize, kTelemetry | kAtPeriods}};
inline constexpr Topic<geometry_msgs::WrenchStamped> kAppliedWrenchTopic{
    {"applied_wrench", kRecorderQueueSize, kRecorded | kLatched | kAtInstants}};
inline constexpr Topic<LoadsStamped> kLoadsTopic{{"loads", kRecorderQueueSize, kRecorded | kLatched}};
inline constexpr Topic<nav_msgs::Odometry> kStateSetTopic{{"state_set", kRecorderQueueSize, kRecorded}};
inline constexpr Topic<std_msgs::String> kSceneTopic{{"scene", kDriverQueueSize, kRecorded | kLatched}};
#ifdef YOUBOT_BASE_SIM_PR2_MSGS
inline constexpr Topic<pr2_msgs::PowerBoardState> kDashboardTopic{{"/dashboard/platform_state", kDriverQueueSize, 0}};
#endif
inline constexpr Topic<diagnostic_msgs::DiagnosticArray> kDiagnosticsTopic{{"/diagnostics", kDriverQueueSize, 0}};
inline constexpr Topic<rosgraph_msgs::Clock> kClockTopic{{"/clock", kRecorderQueueSize, kAwaited | kAtPeriods}};

inline constexpr auto kTopics = std::make_tuple(
#ifdef YOUBOT_BASE_SIM_PR2_MSGS
    kDashboardTopic,
#endif
    kOdometryTopic, kGroundTruthTopic, kJointStatesTopic, kImuTopic, kTransformsTopic, kStaticTransformsTopic,
    kContactsTopic, kContactMarkersTopic, kRollerSwitchesTopic, kAppliedWrenchTopic, kLoadsTopic, kStateSetTopic,
    kSceneTopic, kDiagnosticsTopic, kClockTopic);

/// Calls `visit(topic)` for each, a Topic of its message.
template <class Visit>
void visit_topics(const Visit& visit) {
  std::apply([&visit](const auto&... topics) { (visit(topics), ...); }, kTopics);
}

}  // namespace youbot_base_sim
