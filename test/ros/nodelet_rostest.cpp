// The base as a nodelet, with this program as its manager.

#include <geometry_msgs/Twist.h>
#include <nodelet/loader.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <set>

#include "base_process.h"

namespace youbot_base_sim {
namespace {

class BaseNodelet : public ::testing::Test {
 protected:
  ~BaseNodelet() override {
    loader_.unload("/base");
    ros::param::del("/base");
  }

  bool load() { return loader_.load("/base", "youbot_base_sim/Base", {}, {}); }

  void expect_odometry(std::size_t n) {
    wait_for("odometry", [&] { return odometry_.size() >= n; });
  }

  ros::NodeHandle node_;
  std::vector<nav_msgs::Odometry::ConstPtr> odometry_;
  ros::Subscriber subscriber_ = node_.subscribe<nav_msgs::Odometry>(
      "/odom", 1000, [this](const nav_msgs::Odometry::ConstPtr& message) { odometry_.push_back(message); });
  TemporaryFolder folder_;
  nodelet::Loader loader_{false};
};

TEST_F(BaseNodelet, takes_commands_and_hands_out_messages_without_a_copy) {
  ASSERT_TRUE(load());
  ros::NodeHandle node;  // whose subscriber is another than the fixture's
  std::set<const nav_msgs::Odometry*> others;
  const ros::Subscriber other = node.subscribe<nav_msgs::Odometry>(
      "/odom", 1000, [&](const nav_msgs::Odometry::ConstPtr& message) { others.insert(message.get()); });
  const ros::Publisher commands = node.advertise<geometry_msgs::Twist>("/cmd_vel", 1);
  wait_for("the base to listen", [&] { return commands.getNumSubscribers() > 0; });
  geometry_msgs::Twist forward;
  forward.linear.x = 0.3;
  commands.publish(forward);
  wait_for("speed", [&] { return !odometry_.empty() && odometry_.back()->twist.twist.linear.x > 0.2; });
  wait_for("both subscribers", [&] { return others.count(odometry_.back().get()) > 0; });
}

TEST_F(BaseNodelet, ends_in_order_when_it_is_unloaded) {
  ros::param::set("/base/publish_clock", true);
  for (const std::string bag : {"first.bag", "second.bag"}) {  // the same manager takes it again
    ros::param::set("/base/bag", folder_.path(bag));
    odometry_.clear();
    ASSERT_TRUE(load());
    expect_odometry(20);
    const ros::WallTime start = ros::WallTime::now();
    ASSERT_TRUE(loader_.unload("/base"));
    EXPECT_LT((ros::WallTime::now() - start).toSec(), 2);
    EXPECT_EQ(subscriber_.getNumPublishers(), 0u);
    EXPECT_FALSE(ros::service::exists("/base/step", false));
    EXPECT_GE(rosbag::View(rosbag::Bag(folder_.path(bag)), rosbag::TopicQuery("/odom")).size(), 20u);
  }
}

TEST_F(BaseNodelet, is_refused_for_a_wrong_parameter) {
  ros::param::set("/base/publish_rate", -1);
  EXPECT_FALSE(load());
  ros::param::set("/base/publish_rate", 100);
  EXPECT_TRUE(load()) << "the manager goes on";
  expect_odometry(5);
}

/// Every message of a bag but diagnostics, which have wall time.
std::vector<std::string> messages_of(const std::string& path) {
  const rosbag::Bag bag(path);
  std::vector<std::string> messages;
  for (const rosbag::MessageInstance& message : rosbag::View(bag)) {
    std::string bytes(message.size(), '\0');
    ros::serialization::OStream stream(reinterpret_cast<std::uint8_t*>(bytes.data()), message.size());
    message.write(stream);
    messages.push_back(message.getTopic().substr(message.getTopic().rfind('/')) + bytes);
  }
  return messages;
}

TEST_F(BaseNodelet, has_the_bits_of_the_node) {
  const std::string scene = folder_.write("rolling.yaml", "initial: {wheel_rates: [9, 8, 8, 9]}\n");
  const std::string bags[] = {folder_.path("node.bag"), folder_.path("nodelet.bag")};
  Program node(BASE_NODE, {"__name:=base", "_scene:=" + scene, "_publish_clock:=true", "_real_time_factor:=0",
                           "_end_time:=1", "_bag:=" + bags[0]});
  EXPECT_EQ(node.wait(), 0) << node.out() << node.err();
  ros::param::set("/base/scene", scene);
  ros::param::set("/base/publish_clock", true);
  ros::param::set("/base/real_time_factor", 0);
  ros::param::set("/base/end_time", 1.0);
  ros::param::set("/base/bag", bags[1]);
  ASSERT_TRUE(load());
  wait_for("the end", [&] { return folder_.has("nodelet.bag"); });
  loader_.unload("/base");
  const std::vector<std::string> expected = messages_of(bags[0]);
  EXPECT_GT(expected.size(), 200u);
  EXPECT_EQ(messages_of(bags[1]), expected);
}

}  // namespace
}  // namespace youbot_base_sim

int main(int argc, char** argv) { return youbot_base_sim::run_rostest(argc, argv); }
