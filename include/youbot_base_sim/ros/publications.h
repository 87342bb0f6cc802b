#pragma once

#include <ros/ros.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "youbot_base_sim/ros/topics.h"

namespace youbot_base_sim {

/// The publishers of a node, by topic, and whether each has a subscriber: as of the last callback, so the answer
/// changes only where the node processes its callbacks.
class Publications {
 public:
  Publications() = default;
  Publications(const Publications&) = delete;
  Publications& operator=(const Publications&) = delete;

  template <class Message>
  void advertise(
      ros::NodeHandle& node, const Topic<Message>& topic, std::uint32_t queue_size,
      const std::function<void()>& greet = [] {}) {
    Publication& publication = publications_[topic.name];
    publication.row = topic;
    const auto count = [&publication, greet](const ros::SingleSubscriberPublisher&) {
      publication.heard = publication.publisher.getNumSubscribers() > 0;
      greet();
    };
    publication.publisher = node.advertise<Message>(topic.name, queue_size, count, count, {}, topic.is(kLatched));
  }

  /// True if a topic with this property has a subscriber.
  bool heard(TopicProperty property) const {
    return std::any_of(publications_.begin(), publications_.end(),
                       [=](const auto& one) { return one.second.heard && one.second.row.is(property); });
  }

  /// Publishes the message that make() makes, if the topic is advertised and has a subscriber or is latched. Nodelets
  /// of the same manager get it without a copy.
  template <class Make>
  void publish(const TopicRow& topic, const Make& make) const {
    const auto found = publications_.find(topic);
    if (found == publications_.end() || !(found->second.heard || topic.is(kLatched))) return;
    found->second.publisher.publish(boost::make_shared<decltype(make())>(make()));
  }

  /// Calls `visit(row)` for each advertised topic without a subscriber.
  template <class Visit>
  void visit_unheard(const Visit& visit) const {
    for (const auto& [topic, publication] : publications_) {
      if (!publication.heard) visit(publication.row);
    }
  }

 private:
  struct Publication {
    TopicRow row{};
    ros::Publisher publisher;
    bool heard = false;
  };

  std::map<std::string, Publication> publications_;
};

}  // namespace youbot_base_sim
