// What the topic `contacts` tells, without a ROS master.

#include <gtest/gtest.h>

#include <cmath>

#include "temporary_folder.h"
#include "youbot_base_sim/ros/conversions.h"

namespace youbot_base_sim {
namespace {

Scene sideways(Model model = Model::kCoulomb) {
  return load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case2.yaml", {{"model", name_of(model)}});
}

ContactsStamped contacts_at(double t, const Scene& scene) {
  Simulation simulation(scene);
  simulation.advance_to(t);
  return contacts_message(simulation, stamp_of(t));
}

TEST(ContactsMessage, tells_where_and_how_the_wheels_stand) {
  const Scene scene = sideways();
  const RobotParameters& robot = scene.robot;
  Simulation simulation(scene);
  simulation.advance_to(1.5);
  const ContactsStamped message = contacts_message(simulation, stamp_of(1.5));
  EXPECT_EQ(message.header.stamp, ros::Time(1.5));
  EXPECT_EQ(message.header.frame_id, "base_footprint");
  EXPECT_EQ(message.t, 1.5);
  EXPECT_EQ(message.kinetic_energy, simulation.kinetic_energy());
  ASSERT_EQ(message.contacts.size(), 4u);
  double weight = 0;
  for (int i = 0; i < kWheels; ++i) {
    const Contact& contact = message.contacts[i];
    SCOPED_TRACE(contact.wheel);
    EXPECT_EQ(contact.wheel, wheel_joint(i));
    EXPECT_EQ(contact.position.x, robot.rho_X()[i]);
    // The contact point wanders along the axle by R_d tan(delta) tan(phi~): by 20 mm to either side.
    EXPECT_NEAR(contact.position.y, robot.rho_Y()[i], robot.R_d * std::tan(M_PI / robot.rollers));
    EXPECT_NE(contact.position.y, robot.rho_Y()[i]);
    EXPECT_EQ(contact.position.z, -0.084);
    EXPECT_EQ(contact.roller, simulation.rollers()[i]);
    EXPECT_EQ(contact.other_roller, -1);
    EXPECT_EQ(contact.torque, simulation.torque()[i]);
    // Friction acts against slip, within its limit.
    const auto &slip = contact.slip_velocity, &force = contact.friction_force;
    EXPECT_LT(slip.x * force.x + slip.y * force.y, 0);
    EXPECT_NEAR(slip.x * force.y - slip.y * force.x, 0, 1e-9 * std::hypot(slip.x, slip.y));
    EXPECT_NEAR(contact.friction_share, std::hypot(force.x, force.y) / (0.5 * contact.normal_force), 1e-12);
    EXPECT_GT(contact.friction_share, 0);
    EXPECT_LE(contact.friction_share, 1);
    weight += contact.normal_force;
  }
  EXPECT_NEAR(weight, robot.m_s() * 9.81, 1e-9);
}

TEST(ContactsMessage, knows_what_a_model_does_not) {
  for (const Model model : {Model::kNoSlip, Model::kViscous}) {
    const ContactsStamped message = contacts_at(1, sideways(model));
    for (const Contact& contact : message.contacts) {
      EXPECT_EQ(contact.friction_share, 0);
      EXPECT_GT(contact.normal_force, 0);
      EXPECT_EQ(contact.friction_force.x == 0, model == Model::kNoSlip);
    }
    EXPECT_GT(message.drive_power, 0);
    EXPECT_EQ(message.floor_power == 0, model == Model::kNoSlip);
  }
}

TEST(ContactsMessage, tells_both_rollers_of_a_wheel_between_two) {
  const TemporaryFolder folder;
  Simulation simulation(load_scene(
      folder.write("scene.yaml",
                   "duration: 10\ndrive: {torque: [{start: 0, constant: [-1.6608860541984796, 0.6423426008195765, "
                   "1.6391085502068918, 1.12921153639236]}]}\n")));
  int held = 0;
  for (int k = 0; k < 1000; ++k) {
    simulation.advance_to(0.01 * k);
    const ContactsStamped message = contacts_message(simulation, ros::Time(1));
    for (int i = 0; i < kWheels; ++i) {
      const int other = simulation.other_rollers()[i].value_or(-1);
      EXPECT_EQ(message.contacts[i].other_roller, other);
      if (other >= 0) ++held;
    }
  }
  EXPECT_GT(held, 0);
}

}  // namespace
}  // namespace youbot_base_sim
