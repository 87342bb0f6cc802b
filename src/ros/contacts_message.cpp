#include "youbot_base_sim/ros/contacts_message.h"

#include <cmath>

#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/scene/frames.h"

namespace youbot_base_sim {

ContactsStamped contacts_message(const Simulation& simulation, const ros::Time& stamp) {
  const Scene& scene = simulation.scene();
  const ContactDetails contacts = simulation.contacts();
  const Wheels torque = simulation.torque();
  const Wheels X = scene.robot.rho_X(), Y = scene.robot.rho_Y() + contacts.Delta_Y;
  const auto rollers = simulation.rollers();
  const auto other_rollers = simulation.other_rollers();

  ContactsStamped message;
  message.header.stamp = stamp;
  message.header.frame_id = kBaseFrame;
  message.t = simulation.time();
  message.contacts.resize(kWheels);
  for (int i = 0; i < kWheels; ++i) {
    Contact& contact = message.contacts[i];
    contact.wheel = wheel_joint(i);
    contact.position = vector_message<geometry_msgs::Point>({X[i], Y[i], floor_height(scene.robot)});
    contact.slip_velocity = vector_message<geometry_msgs::Vector3>({contacts.V_PX[i], contacts.V_PY[i], 0});
    contact.friction_force = vector_message<geometry_msgs::Vector3>({contacts.F_X[i], contacts.F_Y[i], 0});
    contact.normal_force = contacts.N[i];
    const double limit = limits_friction(scene.model) ? contacts.f[i] * contacts.N[i] : 0;
    contact.friction_share = limit > 0 ? std::hypot(contacts.F_X[i], contacts.F_Y[i], contacts.F_Z[i]) / limit : 0;
    contact.torque = torque[i];
    contact.roller = static_cast<std::uint8_t>(rollers[i]);
    contact.other_roller = static_cast<std::int16_t>(other_rollers[i].value_or(-1));
  }
  const PowerBalance power = simulation.power_balance();
  message.kinetic_energy = simulation.kinetic_energy();
  message.drive_power = power.drive;
  message.bearing_power = power.bearings;
  message.roller_power = power.rollers;
  message.floor_power = power.floor;
  message.external_power = power.external;
  return message;
}

}  // namespace youbot_base_sim
