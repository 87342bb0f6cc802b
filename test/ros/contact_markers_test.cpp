// What rviz is told of the contacts, without a ROS master.

#include "youbot_base_sim/ros/contact_markers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "youbot_base_sim/ros/contacts_message.h"
#include "youbot_base_sim/scene/frames.h"

namespace youbot_base_sim {
namespace {

using visualization_msgs::Marker;

class ContactMarkersTest : public testing::Test {
 protected:
  ContactMarkersTest() : simulation_(load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case2.yaml")) {
    simulation_.advance_to(1.5);
    contacts_ = contacts_message(simulation_, ros::Time(1.5));
    options_.roller_mesh = "package://somewhere/roller.dae";
  }

  /// By "namespace/id".
  std::map<std::string, Marker> markers() const {
    std::map<std::string, Marker> result;
    for (const Marker& marker : contact_markers(contacts_, simulation_, 0.5, options_).markers) {
      EXPECT_TRUE(result.emplace(marker.ns + "/" + std::to_string(marker.id), marker).second) << "one of each";
    }
    return result;
  }

  static bool same(const std_msgs::ColorRGBA& a, const std_msgs::ColorRGBA& b) {
    return a.r == b.r && a.g == b.g && a.b == b.b && a.a == b.a;
  }

  Simulation simulation_;
  ContactsStamped contacts_;
  MarkerOptions options_;
};

TEST_F(ContactMarkersTest, ArrowsStartAtTheContactAndHaveTheirScale) {
  options_.friction_scale = 1e-3;
  options_.slip_scale = 10;
  const auto shown = markers();
  for (int i = 0; i < kWheels; ++i) {
    const Contact& contact = contacts_.contacts[i];
    const Marker& friction = shown.at("friction/" + std::to_string(i));
    EXPECT_EQ(friction.type, Marker::ARROW);
    ASSERT_EQ(friction.points.size(), 2u);
    EXPECT_EQ(friction.points[0].x, contact.position.x);
    EXPECT_EQ(friction.points[0].y, contact.position.y);
    EXPECT_EQ(friction.points[0].z, contact.position.z);
    EXPECT_NEAR(friction.points[1].x - friction.points[0].x, 1e-3 * contact.friction_force.x, 1e-12);
    EXPECT_NEAR(friction.points[1].y - friction.points[0].y, 1e-3 * contact.friction_force.y, 1e-12);
    const Marker& slip = shown.at("slip/" + std::to_string(i));
    ASSERT_EQ(slip.points.size(), 2u);
    EXPECT_NEAR(slip.points[1].x - slip.points[0].x, 10 * contact.slip_velocity.x, 1e-12);
    EXPECT_FALSE(same(slip.color, friction.color));
  }
}

TEST_F(ContactMarkersTest, ArrowsThatAreTooLongAreCutAndThoseTooShortGo) {
  contacts_.contacts[0].slip_velocity.x = 3;
  contacts_.contacts[0].slip_velocity.y = 4;
  contacts_.contacts[1].slip_velocity = geometry_msgs::Vector3();
  const auto shown = markers();
  const Marker& slip = shown.at("slip/0");
  EXPECT_NEAR(slip.points[1].x - slip.points[0].x, 0.6 * kMaxArrow, 1e-12);
  EXPECT_NEAR(slip.points[1].y - slip.points[0].y, 0.8 * kMaxArrow, 1e-12);
  EXPECT_EQ(shown.at("slip/1").action, Marker::DELETE);
}

TEST_F(ContactMarkersTest, SaturatedContactsHaveAColourOfTheirOwn) {
  contacts_.contacts[0].friction_share = 0.5;
  contacts_.contacts[1].friction_share = 1;
  const auto shown = markers();
  for (const std::string ns : {"contact_points/", "rollers/"}) {
    const std::string second = ns == "rollers/" ? "2" : "1";
    EXPECT_FALSE(same(shown.at(ns + "0").color, shown.at(ns + second).color)) << ns;
  }
  EXPECT_TRUE(same(shown.at("contact_points/1").color, shown.at("rollers/2").color));
}

// The roller's lowest point is the contact, where the physics has it: on its axis, r over the floor.
TEST_F(ContactMarkersTest, ColoursTheRollersThatAreOnTheFloor) {
  const RobotParameters& robot = simulation_.scene().robot;
  contacts_.contacts[2].other_roller = static_cast<std::int16_t>((contacts_.contacts[2].roller + 1) % robot.rollers);
  const auto shown = markers();
  for (int i = 0; i < kWheels; ++i) {
    const Marker& roller = shown.at("rollers/" + std::to_string(2 * i));
    EXPECT_EQ(roller.mesh_resource, options_.roller_mesh);
    const auto& q = roller.pose.orientation;
    const Eigen::Vector3d axis = Eigen::Quaterniond(q.w, q.x, q.y, q.z) * Eigen::Vector3d::UnitX();
    const auto& centre = roller.pose.position;
    const auto& contact = contacts_.contacts[i].position;
    const double along = (contact.y - centre.y) / axis.y();
    EXPECT_NEAR(centre.x + along * axis.x(), contact.x, 1e-9) << "the axis passes over the contact";
    EXPECT_LT(std::hypot(contact.x - centre.x, contact.y - centre.y), robot.R);
    EXPECT_EQ(shown.at("rollers/" + std::to_string(2 * i + 1)).action == Marker::DELETE, i != 2);
  }
  options_.roller_mesh.clear();
  EXPECT_EQ(markers().count("rollers/0"), 0u);
}

TEST_F(ContactMarkersTest, TellsTimeSpeedAndSwitches) {
  options_.frame = "ground_truth/base_footprint";
  const auto shown = markers();
  const Marker& status = shown.at("status/0");
  EXPECT_EQ(status.type, Marker::TEXT_VIEW_FACING);
  EXPECT_EQ(status.text,
            "t = 1.5 s, 0.50 of real time, " + std::to_string(simulation_.statistics().switches) + " switches");
  EXPECT_EQ(status.header.frame_id, "ground_truth/base_footprint");
  EXPECT_GT(simulation_.statistics().switches, 0u);
}

}  // namespace
}  // namespace youbot_base_sim
