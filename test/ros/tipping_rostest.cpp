// A base that is pushed over its side: the node goes on, and says so in its log, in /diagnostics and in rviz.

#include <diagnostic_msgs/DiagnosticArray.h>
#include <visualization_msgs/MarkerArray.h>

#include "log.h"

namespace youbot_base_sim {
namespace {

using diagnostic_msgs::DiagnosticStatus;
using visualization_msgs::Marker;

TEST(TippingBase, is_an_error_while_it_tips_and_a_warning_afterwards) {
  Log& log = Log::of(BaseClient::fresh());
  BaseClient& base = BaseClient::fresh();  // time has gone on meanwhile, perhaps to the limit
  ros::NodeHandle node;
  diagnostic_msgs::DiagnosticArray diagnostics;
  visualization_msgs::MarkerArray markers;
  const std::vector<ros::Subscriber> subscribers = {
      node.subscribe<diagnostic_msgs::DiagnosticArray>("/diagnostics", 100,
                                                       [&](const auto& message) { diagnostics = *message; }),
      node.subscribe<visualization_msgs::MarkerArray>("contact_markers", 100,
                                                      [&](const auto& message) { markers = *message; })};
  base.wait_for("the connections",
                [&] { return subscribers[0].getNumPublishers() == 1 && subscribers[1].getNumPublishers() == 1; });
  const auto reactions_at = [&](double t) {
    while (base.time() < t) base.idle(1);
    base.wait_for("diagnostics", [&] { return diagnostics.header.stamp == stamp_of(t); });
    for (const DiagnosticStatus& status : diagnostics.status) {
      if (status.name == "youbot_base_sim: normal reactions") return status;
    }
    throw std::runtime_error("no status of the normal reactions");
  };
  const auto marker = [&](const std::string& ns, int id) {
    base.wait_for("markers",
                  [&] { return !markers.markers.empty() && markers.markers[0].header.stamp == base.clock(); });
    for (const Marker& one : markers.markers) {
      if (one.ns == ns && one.id == id) return one;
    }
    throw std::runtime_error("no marker " + ns);
  };

  while (base.time() < 1) base.idle(1);
  EXPECT_EQ(marker("status", 1).action, Marker::DELETE);
  EXPECT_EQ(marker("off_floor", 1).action, Marker::DELETE);

  const DiagnosticStatus during = reactions_at(2);
  log.expect(base, rosgraph_msgs::Log::ERROR, {"the base tips over at t = 1.5", "left side", "goes on"});
  EXPECT_EQ(during.level, DiagnosticStatus::ERROR);
  EXPECT_EQ(during.message, "the base is at its tipping limit, on the wheels of the left side");
  EXPECT_EQ(marker("status", 1).text, "TIPPING: the wheels of the left side carry all");
  for (const int right : {1, 3}) EXPECT_EQ(marker("off_floor", right).text, "off the floor");
  for (const int left : {0, 2}) EXPECT_EQ(marker("off_floor", left).action, Marker::DELETE);

  const DiagnosticStatus after = reactions_at(4);
  EXPECT_EQ(after.level, DiagnosticStatus::WARN);
  EXPECT_EQ(after.message, "the base was at its tipping limit, on the wheels of the left side");
  for (const auto& pair : after.values) {
    if (pair.key == "at the tipping limit") {
      EXPECT_NEAR(std::stod(pair.value), 1.5, 0.05);
    }
  }
  EXPECT_EQ(marker("status", 1).action, Marker::DELETE);
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
