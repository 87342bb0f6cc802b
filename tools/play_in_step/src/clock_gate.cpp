// Lets simulated time advance in step for a program that publishes on its own, such as play_in_step: sends /clock to
// the time on its topic `~advance` and answers on `~done` once all nodes that follow /clock rest. An answer that is not
// empty says why another run may have another result.

#include <ros/ros.h>
#include <std_msgs/String.h>
#include <std_msgs/Time.h>

#include <atomic>

#include "youbot_base_sim/lockstep/clock_followers.h"
#include "youbot_base_sim/ros/program.h"

namespace {

using namespace youbot_base_sim;

void run() {
  Parameters parameters(ros::NodeHandle("~"), "~");
  double timeout = 10;
  parameters.read("timeout", timeout, {1e-3, 1e6, "s"});
  parameters.refuse_others();
  ros::NodeHandle node, own("~");
  const std::atomic<bool> never{false};
  ClockFollowers gate(node, std::chrono::duration<double>(timeout), never);
  const ros::Publisher done = own.advertise<std_msgs::String>("done", 10);
  const ros::Subscriber advance = own.subscribe<std_msgs::Time>(
      "advance", 10,
      [&](const std_msgs::Time::ConstPtr& message) {
        gate.announce(message->data);
        gate.await_rest();
        std_msgs::String answer;
        answer.data = gate.broken_promise();
        done.publish(answer);
      },
      {}, ros::TransportHints().tcpNoDelay());
  ros::spin();
}

}  // namespace

int main(int argc, char** argv) { return run_program(argc, argv, "clock_gate", run); }
