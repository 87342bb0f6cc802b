// A node whose time waits says for what, on the console and in /diagnostics.

#include <diagnostic_msgs/DiagnosticArray.h>

#include <csignal>
#include <map>

#include "base_process.h"
#include "rostest_main.h"

namespace youbot_base_sim {
namespace {

// By the names that topics have where the node runs.
TEST(Waits, are_told) {
  struct Case {
    std::vector<std::string> arguments;
    std::string words;
  };
  const std::map<std::string, Case> cases = {
      {"subscribers",
       {{"_wait_for_subscribers:=true", "base/joint_states:=wheels"},
        "time starts when these topics have subscribers: /tf /subscribers/wheels /subscribers/base/roller_switches"}},
      {"lockstep",
       {{"_lockstep:=true", "cmd_vel:=/go"},
        "lockstep: the simulation begins with ~unpause or a command on /go, "
        "/lockstep/base/base_controller/torques_command or /lockstep/base/"}},
      {"paused", {{"_start_paused:=true"}, "time waits, paused at t = 0 s, for ~unpause or ~step"}}};
  ros::NodeHandle node;
  std::map<std::string, int> warnings;
  const ros::Subscriber diagnostics = node.subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 100, [&](const diagnostic_msgs::DiagnosticArray::ConstPtr& message) {
        for (const auto& status : message->status) {
          if (status.name != "youbot_base_sim: time" || status.level != status.WARN) continue;
          for (const auto& [ns, expected] : cases)
            warnings[ns] += status.message.find(expected.words) != std::string::npos;
        }
      });
  std::map<std::string, std::unique_ptr<BaseProcess>> nodes;
  for (const auto& [ns, expected] : cases) {
    std::vector<std::string> arguments = expected.arguments;
    arguments.push_back("_publish_clock:=true");
    nodes[ns] = std::make_unique<BaseProcess>(ns, arguments);
  }
  for (const auto& [ns, expected] : cases) {
    wait_for(expected.words.c_str(), [&, name = ns] { return warnings[name] > 0; });
    nodes[ns]->send(SIGINT);
    nodes[ns]->expect_end(0, expected.words);
  }
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
