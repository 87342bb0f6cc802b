// The topic `contacts` tells its subscribers what happens on the floor, and its powers are those of the motion. Time
// starts without a subscriber: the client of the other tests has none.

#include <youbot_base_sim/ContactsStamped.h>

#include "base_client.h"

namespace youbot_base_sim {
namespace {

TEST(ContactsTopic, tells_who_subscribes_what_drives_the_base) {
  BaseClient& base = BaseClient::fresh();
  ros::NodeHandle node;
  ContactsStamped latest;
  const ros::Subscriber subscriber = node.subscribe<ContactsStamped>(
      "contacts", 1000, [&](const auto& message) { latest = *message; }, {}, ros::TransportHints().tcpNoDelay());
  base.wait_for("the connection", [&] { return subscriber.getNumPublishers() == 1; });
  const auto advance = [&] {
    base.command(twist(0.2, 0.1, 0.3));
    base.wait_for("the contacts of the present time", [&] { return latest.header.stamp == base.clock(); });
  };
  // Each millisecond of the start, in which the base gains what the drives put in and nothing else takes.
  advance();
  const double energy_before = latest.kinetic_energy;
  double work = -latest.drive_power / 2 * 1e-3, taken = 0;
  for (int k = 0; k < 200; ++k) {
    advance();
    ASSERT_EQ(latest.contacts.size(), 4u);
    EXPECT_EQ(latest.contacts[2].wheel, "wheel_joint_bl");
    work += 1e-3 * latest.drive_power;
    taken += 1e-3 * (latest.bearing_power + latest.roller_power + latest.floor_power);
  }
  const double gained = latest.kinetic_energy - energy_before;
  EXPECT_GT(gained, 0.3);
  EXPECT_GT(taken, 0);
  EXPECT_NEAR(work - taken, gained, 0.05 * work);
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
