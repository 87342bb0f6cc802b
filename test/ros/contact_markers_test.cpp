// What rviz is told of the contacts, without a ROS master.

#include "youbot_base_sim/ros/view/contact_markers.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "temporary_folder.h"
#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/scene/frames.h"

namespace youbot_base_sim {
namespace {

using visualization_msgs::Marker;

/// By "namespace/id".
std::map<std::string, Marker> by_name(const visualization_msgs::MarkerArray& array) {
  std::map<std::string, Marker> result;
  for (const Marker& marker : array.markers) {
    EXPECT_TRUE(result.emplace(marker.ns + "/" + std::to_string(marker.id), marker).second) << "one of each";
  }
  return result;
}

class ContactMarkersTest : public testing::Test {
 protected:
  ContactMarkersTest() : simulation_(load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case2.yaml")) {
    simulation_.advance_to(1.5);
    contacts_ = contacts_message(simulation_, ros::Time(1.5));
    for (int i = 0; i < kWheels; ++i) options_.roller_meshes[i] = fmt::format("package://somewhere/roller_{}.dae", i);
  }

  std::map<std::string, Marker> markers() const { return by_name(ContactMarkers(options_).at(contacts_, simulation_)); }

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
    EXPECT_EQ(roller.mesh_resource, options_.roller_meshes[i]);
    const auto& q = roller.pose.orientation;
    const Eigen::Vector3d axis = Eigen::Quaterniond(q.w, q.x, q.y, q.z) * Eigen::Vector3d::UnitX();
    const auto& centre = roller.pose.position;
    const auto& contact = contacts_.contacts[i].position;
    const double along = (contact.y - centre.y) / axis.y();
    EXPECT_NEAR(centre.x + along * axis.x(), contact.x, 1e-9) << "the axis passes over the contact";
    EXPECT_LT(std::hypot(contact.x - centre.x, contact.y - centre.y), robot.R);
    EXPECT_EQ(shown.at("rollers/" + std::to_string(2 * i + 1)).action == Marker::DELETE, i != 2);
  }
  options_.roller_meshes[0].clear();
  EXPECT_EQ(markers().count("rollers/0"), 0u);
}

TEST_F(ContactMarkersTest, SaysTimeAndSwitches) {
  options_.frame = "ground_truth/base_footprint";
  const auto shown = markers();
  const Marker& status = shown.at("status/0");
  EXPECT_EQ(status.type, Marker::TEXT_VIEW_FACING);
  EXPECT_EQ(status.text, "t = 1.5 s, " + std::to_string(simulation_.statistics().switches) + " switches");
  EXPECT_EQ(status.header.frame_id, "ground_truth/base_footprint");
  EXPECT_GT(simulation_.statistics().switches, 0u);
}

TEST_F(ContactMarkersTest, ShowsNothingBeyondThePaperUnlessAsked) {
  for (const auto& [name, marker] : markers()) {
    const std::string& ns = marker.ns;
    EXPECT_TRUE(ns == "contact_points" || ns == "friction" || ns == "slip" || ns == "rollers" || ns == "status" ||
                ns == "legend")
        << name;
  }
}

class BeyondMarkersTest : public testing::Test {
 protected:
  /// What is shown of a scene at time t (s), by "namespace/id".
  std::map<std::string, Marker> shown(const std::string& text, double t = 0) {
    simulation_ = std::make_unique<Simulation>(load_scene(folder_.write("scene.yaml", "duration: 9\n" + text)));
    simulation_->continue_when_tipping();
    markers_ = std::make_unique<ContactMarkers>(marker_options(simulation_->scene().robot, true));
    return shown_at(t);
  }

  std::map<std::string, Marker> shown_at(double t) {
    simulation_->advance_to(t);
    return by_name(markers_->at(contacts_message(*simulation_, ros::Time(1)), *simulation_));
  }

  TemporaryFolder folder_;
  std::unique_ptr<Simulation> simulation_;
  std::unique_ptr<ContactMarkers> markers_;
};

Eigen::Vector3d vector(const geometry_msgs::Point& point) { return {point.x, point.y, point.z}; }

TEST_F(BeyondMarkersTest, NormalReactionsPointUpWithTheScaleOfForces) {
  for (const std::string scene : {"robot: {normal_reactions: dynamic}", "robot: {diagonal_preload: 10}",
                                  "floor: {friction: [0.5, 0.5, 0.5, 0.4]}"}) {
    const auto markers = shown(scene);
    const Wheels N = simulation_->contacts().N;
    for (int i = 0; i < kWheels; ++i) {
      const Marker& arrow = markers.at("normal_reactions/" + std::to_string(i));
      const Eigen::Vector3d way = vector(arrow.points.at(1)) - vector(arrow.points.at(0));
      EXPECT_NEAR(way.z(), std::min(3e-3 * N[i], kMaxArrow), 1e-12) << scene;
      EXPECT_EQ(way.x(), 0);
      EXPECT_EQ(markers.at("off_floor/" + std::to_string(i)).action, Marker::DELETE);
    }
  }
}

TEST_F(BeyondMarkersTest, WheelsThatHaveLiftedAreMarked) {
  const auto markers =
      shown("robot: {normal_reactions: dynamic}\nwrenches: [{force: [0, 200, 0], point: [0, 0, 1]}]\n", 0.01);
  EXPECT_EQ(markers.at("off_floor/1").text, "off the floor");
  EXPECT_EQ(markers.at("normal_reactions/1").action, Marker::DELETE);
  EXPECT_EQ(markers.at("off_floor/0").action, Marker::DELETE);
  EXPECT_EQ(markers.at("status/1").text, "TIPPING: the wheels of the left side carry all");
}

TEST_F(BeyondMarkersTest, TheSlopePointsUphillWhateverTheHeading) {
  for (const double sign : {1.0, -1.0}) {
    const auto markers = shown("initial: {pose: [0, 0, 0.3]}\nfloor: {slope: {angle: " + std::to_string(sign * 0.1) +
                               ", uphill: 1.2}}\n");
    const Marker& arrow = markers.at("slope/0");
    const Eigen::Vector3d way = sign * (vector(arrow.points.at(1)) - vector(arrow.points.at(0)));
    EXPECT_NEAR(std::atan2(way.y(), way.x()), 1.2 - 0.3, 1e-9);
    EXPECT_EQ(markers.at("slope/1").text, "uphill, 5.73 deg");
    EXPECT_EQ(markers.at("legend/5").text, "the floor slopes by 5.73 deg, drawn level");
    EXPECT_EQ(markers.at("legend/6").action, Marker::DELETE) << "of a push, if there was one";
  }
}

TEST_F(BeyondMarkersTest, PatchesLieOnTheFloor) {
  const auto markers = shown("floor: {patches: [{rectangle: [1, 2, 3, 5], friction: 0.1, edge: 0.2}]}");
  const Marker& area = markers.at("patches/0");
  EXPECT_EQ(area.header.frame_id, "world");
  EXPECT_TRUE(area.pose.position.x == 2 && area.pose.position.y == 3.5 && area.scale.x == 2 && area.scale.y == 3);
  EXPECT_NEAR(area.pose.position.z, floor_height(simulation_->scene().robot), 0.01);
  EXPECT_EQ(markers.at("patches/1").text, "friction 0.1");
  EXPECT_EQ(markers.at("patches/1").header.frame_id, "world");
}

TEST_F(BeyondMarkersTest, LoadsAndWrenchesAreWhereTheyAreAndGo) {
  const std::string text =
      "loads: [{mass: 20, position: [0.1, 0.05, 0.2], end: 0.01}]\n"
      "wrenches: [{force: [10, 0, 0], point: [0.2, 0, 0.1], torque: -3, end: 0.01, frame: fixed}]\n"
      "initial: {pose: [0, 0, 1.5707963267948966]}\n";
  auto markers = shown(text);
  const Marker& box = markers.at("loads/0");
  EXPECT_NEAR((vector(box.pose.position) - Eigen::Vector3d(0.1, 0.05, 0.2 + kAxleHeight)).norm(), 0, 1e-12);
  EXPECT_NEAR(std::pow(box.scale.x, 3) * 2500, 20, 1e-9);
  EXPECT_EQ(markers.at("loads/2").text, "20 kg");
  const Marker& push = markers.at("wrenches/0");
  const Eigen::Vector3d point(0.2, 0, 0.1 + kAxleHeight);
  EXPECT_NEAR((vector(push.points.at(1)) - point).norm(), 0, 1e-12) << "ends where it acts";
  EXPECT_NEAR((vector(push.points.at(1)) - vector(push.points.at(0)) - Eigen::Vector3d(0, -0.03, 0)).norm(), 0, 1e-9);
  const Marker& arc = markers.at("wrenches/1");
  EXPECT_EQ(arc.type, Marker::LINE_STRIP);
  EXPECT_LT((vector(arc.points.at(0)) - point).cross(vector(arc.points.at(1)) - point).z(), 0) << "turns to the right";
  EXPECT_TRUE(std::any_of(markers.begin(), markers.end(), [](const auto& entry) {
    return entry.second.ns == "legend" && entry.second.text.find("push, ") == 0;
  }));
  EXPECT_EQ(markers.at("wrenches/2").text, "10 N, -3 N m");
  markers = shown_at(0.02);
  for (const std::string gone : {"loads/0", "loads/1", "loads/2", "wrenches/0", "wrenches/1", "wrenches/2"}) {
    EXPECT_EQ(markers.at(gone).action, Marker::DELETE) << gone;
  }
}

}  // namespace
}  // namespace youbot_base_sim
