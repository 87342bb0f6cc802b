// A node of lockstep_chains_test.py: `filter` publishes the mean of the odometry it has heard, `controller` commands by
// odometry, `mux` passes commands on; by a loop, timer (50 Hz) or callback. Usage: lockstep_node KIND STYLE IN OUT

#include <geometry_msgs/Twist.h>
#include <nav_msgs/Odometry.h>
#include <ros/ros.h>

#include <string>

namespace {

template <class In, class Out, class Answer>
void run(const std::string& style, const std::string& in, const std::string& out, const Answer& answer) {
  ros::NodeHandle node;
  In heard;
  bool has_heard = false;
  const ros::Publisher publisher = node.advertise<Out>(out, 10);
  const auto act = [&] {
    if (has_heard) publisher.publish(answer(heard));
  };
  const ros::Subscriber subscriber = node.subscribe<In>(in, 10, [&](const boost::shared_ptr<const In>& message) {
    heard = *message;
    has_heard = true;
    if (style == "callback") act();
  });
  const ros::Timer timer = node.createTimer(
      ros::Duration(0.02), [&](const auto&) { act(); }, false, style == "timer");
  if (style != "loop") ros::spin();
  for (ros::Rate rate(50); ros::ok(); rate.sleep()) {
    ros::spinOnce();
    act();
  }
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "lockstep_node");
  if (argc != 5) return 2;
  const std::string kind = argv[1], style = argv[2], in = argv[3], out = argv[4];
  using geometry_msgs::Twist;
  using nav_msgs::Odometry;
  Odometry filtered;
  if (kind == "filter") {
    run<Odometry, Odometry>(style, in, out, [&](const Odometry& odometry) {
      filtered.pose.pose.position.x += 0.5 * (odometry.pose.pose.position.x - filtered.pose.pose.position.x);
      return filtered;
    });
  } else if (kind == "controller") {
    run<Odometry, Twist>(style, in, out, [](const Odometry& odometry) {
      Twist command;
      command.linear.x = 0.1 + 2 * (0.3 - odometry.pose.pose.position.x);
      return command;
    });
  } else {
    run<Twist, Twist>(style, in, out, [](const Twist& command) { return command; });
  }
}
