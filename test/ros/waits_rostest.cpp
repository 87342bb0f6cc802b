// A node whose time waits says for what, on the console and in /diagnostics.

#include <diagnostic_msgs/DiagnosticArray.h>

#include <csignal>
#include <map>

#include "base_process.h"
#include "rostest_main.h"

namespace youbot_base_sim {
namespace {

TEST(Waits, are_told) {
  struct Case {
    std::string parameter, words;
  };
  const std::map<std::string, Case> cases = {
      {"subscribers", {"_wait_for_subscribers:=true", "time starts when these topics have subscribers:"}},
      {"lockstep", {"_lockstep:=true", "lockstep: the simulation begins with ~unpause or a command on cmd_vel"}},
      {"paused", {"_start_paused:=true", "time waits, paused at t = 0 s, for ~unpause or ~step"}}};
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
    nodes[ns] = std::make_unique<BaseProcess>(ns, std::vector<std::string>{"_publish_clock:=true", expected.parameter});
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
