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
#include <stdexcept>
#include <string>
#include <tuple>

#include "youbot_base_sim/ros/node_constants.h"

/// The topics that the node publishes, as one table. Telemetry makes their messages: by a `visit` each those at
/// instants of publishing and those at events. BaseNode publishes the others: fixed transforms, scene, markers and
/// diagnostics.
namespace youbot_base_sim {

/// Properties of a topic, one bit each.
enum TopicProperty : unsigned {
  kLatched = 1 << 0,     ///< later subscribers get the last message
  kRecorded = 1 << 1,    ///< bags and launch/recorder.xml have it
  kAwaited = 1 << 2,     ///< with `~wait_for_subscribers`, time waits for its subscriber
  kOnRequest = 1 << 3,   ///< recorded and awaited only with `~publish_contacts`
  kAtInstants = 1 << 4,  ///< a subscriber has the loop stop at each instant of publishing
  kAtPeriods = 1 << 5,   ///< a subscriber has a loop that is not paced stop after each control period
  kOfDriver = 1 << 6,    ///< stops while the driver has no base, as after a loss of EtherCAT
};

/// A topic without its type.
struct TopicRow {
  const char* name;
  std::uint32_t queue_size;  ///< of the publisher; 0: that of the clock, see NodeClock
  unsigned properties;

  constexpr bool is(TopicProperty property) const { return (properties & property) != 0; }
};

template <class Message>
struct Topic : TopicRow {};

constexpr unsigned kTelemetry = kRecorded | kAwaited | kAtInstants;  ///< most of what is published at each instant

inline constexpr auto kTopics = std::make_tuple(
    Topic<nav_msgs::Odometry>{{kOdometryTopic, 0, kTelemetry | kOfDriver}},
    Topic<nav_msgs::Odometry>{{kGroundTruthTopic, 0, kTelemetry}},
    Topic<sensor_msgs::JointState>{{kJointStatesTopic, 0, kTelemetry | kOfDriver}},
    Topic<sensor_msgs::Imu>{{kImuTopic, 0, kTelemetry}},
    Topic<tf2_msgs::TFMessage>{{kTransformsTopic, 0, kTelemetry | kOfDriver}},
    Topic<tf2_msgs::TFMessage>{{kStaticTransformsTopic, kRecorderQueueSize, kRecorded | kLatched}},
    Topic<ContactsStamped>{{kContactsTopic, 0, kTelemetry | kOnRequest}},
    Topic<visualization_msgs::MarkerArray>{
        {kContactMarkersTopic, kDriverQueueSize, kRecorded | kOnRequest | kAtInstants}},
    Topic<RollerSwitchStamped>{{kRollerSwitchesTopic, kRecorderQueueSize, kTelemetry | kAtPeriods}},
    Topic<geometry_msgs::WrenchStamped>{{kAppliedWrenchTopic, kRecorderQueueSize, kRecorded | kLatched | kAtInstants}},
    Topic<LoadsStamped>{{kLoadsTopic, kRecorderQueueSize, kRecorded | kLatched}},
    Topic<nav_msgs::Odometry>{{kStateSetTopic, kRecorderQueueSize, kRecorded}},
    Topic<std_msgs::String>{{kSceneTopic, kDriverQueueSize, kRecorded | kLatched}},
#ifdef YOUBOT_BASE_SIM_PR2_MSGS
    Topic<pr2_msgs::PowerBoardState>{{kDashboardTopic, kDriverQueueSize, 0}},
#endif
    Topic<diagnostic_msgs::DiagnosticArray>{{kDiagnosticsTopic, kDriverQueueSize, 0}},
    Topic<rosgraph_msgs::Clock>{{kClockTopic, kRecorderQueueSize, kLatched | kAwaited | kAtPeriods}});

/// Calls `visit(topic)` for each row, a Topic of its message.
template <class Visit>
void visit_topics(const Visit& visit) {
  std::apply([&visit](const auto&... topics) { (visit(topics), ...); }, kTopics);
}

/// The row of the topic `name`. Throws std::out_of_range without one.
inline const TopicRow& topic_row(const std::string& name) {
  const TopicRow* row = nullptr;
  visit_topics([&](const TopicRow& topic) {
    if (name == topic.name) row = &topic;
  });
  if (!row) throw std::out_of_range(name + ": no topic of ros/topics.h");
  return *row;
}

}  // namespace youbot_base_sim
