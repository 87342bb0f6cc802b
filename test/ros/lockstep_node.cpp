// A node of lockstep_chains_test.py: `filter` publishes the mean of the odometry it has heard, `controller` commands by
// odometry, `mux` passes commands on; each from a loop or timer of 50 Hz. Usage: lockstep_node KIND STYLE IN OUT

#include <geometry_msgs/Twist.h>
#include <nav_msgs/Odometry.h>
#include <ros/ros.h>

#include <string>

namespace {

template <class In, class Out, class Answer>
void run(bool by_timer, const std::string& in, const std::string& out, const Answer& answer) {
  ros::NodeHandle node;
  In heard;
  bool has_heard = false;
  const ros::Publisher publisher = node.advertise<Out>(out, 10);
  const ros::Subscriber subscriber = node.subscribe<In>(in, 10, [&](const boost::shared_ptr<const In>& message) {
    heard = *message;
    has_heard = true;
  });
  const auto act = [&] {
    if (has_heard) publisher.publish(answer(heard));
  };
  const ros::Timer timer = node.createTimer(
      ros::Duration(0.02), [&](const auto&) { act(); }, false, by_timer);
  if (by_timer) ros::spin();
  for (ros::Rate rate(50); ros::ok(); rate.sleep()) {
    ros::spinOnce();
    act();
  }
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "lockstep_node");
  if (argc != 5) return 2;
  const std::string kind = argv[1], in = argv[3], out = argv[4];
  const bool by_timer = argv[2] == std::string("timer");
  using geometry_msgs::Twist;
  using nav_msgs::Odometry;
  Odometry filtered;
  if (kind == "filter") {
    run<Odometry, Odometry>(by_timer, in, out, [&](const Odometry& odometry) {
      filtered.pose.pose.position.x += 0.5 * (odometry.pose.pose.position.x - filtered.pose.pose.position.x);
      return filtered;
    });
  } else if (kind == "controller") {
    run<Odometry, Twist>(by_timer, in, out, [](const Odometry& odometry) {
      Twist command;
      command.linear.x = 0.1 + 2 * (0.3 - odometry.pose.pose.position.x);
      return command;
    });
  } else {
    run<Twist, Twist>(by_timer, in, out, [](const Twist& command) { return command; });
  }
}
