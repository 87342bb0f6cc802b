// Bags that are written without ROS running.

#include "youbot_base_sim/ros/bag.h"

#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <youbot_base_sim/RollerSwitchStamped.h>

#include <map>
#include <stdexcept>

#include "temporary_folder.h"

namespace youbot_base_sim {
namespace {

Scene short_scene() { return load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case2.yaml"); }

TEST(BagWriter, writes_every_topic_and_every_switch) {
  const TemporaryFolder folder;
  Simulation simulation(short_scene());
  BagWriter bag(folder.path("x.bag"));
  Telemetry telemetry(simulation.scene().robot.rollers, simulation.state().phi(), {});
  std::size_t switches = 0;
  for (int k = 0; k <= 50; ++k) {
    simulation.advance_to(0.01 * k);
    const auto events = simulation.take_switches();
    switches += events.size();
    bag.write(events);
    telemetry.update(simulation.state().phi());
    bag.write(telemetry, simulation, exact_readings(simulation), simulation.time());
  }
  bag.commit();

  rosbag::Bag read(folder.path("x.bag"), rosbag::bagmode::Read);
  std::map<std::string, std::size_t> count;
  boost::shared_ptr<nav_msgs::Odometry> truth;
  rosbag::View view(read);
  for (const rosbag::MessageInstance& message : view) {
    ++count[message.getTopic()];
    if (message.getTopic() == "/ground_truth") truth = message.instantiate<nav_msgs::Odometry>();
    if (message.getTopic() == "/base/roller_switches") {
      EXPECT_EQ(message.getTime(), message.instantiate<RollerSwitchStamped>()->header.stamp);
    }
  }
  EXPECT_GT(switches, 0u);
  const std::map<std::string, std::size_t> expected = {{"/odom", 51u},
                                                       {"/ground_truth", 51u},
                                                       {"/base/joint_states", 51u},
                                                       {"/tf", 51u},
                                                       {"/base/roller_switches", switches}};
  EXPECT_EQ(count, expected);
  EXPECT_EQ(view.getBeginTime(), ros::TIME_MIN);
  EXPECT_EQ(view.getEndTime(), ros::Time(0.5));
  EXPECT_EQ(truth->pose.pose.position.x, simulation.state().x());
}

TEST(BagWriter, leaves_nothing_of_a_bag_that_is_not_committed) {
  const TemporaryFolder folder;
  {
    Simulation simulation(short_scene());
    BagWriter bag(folder.path("x.bag"));
    const MotorReadings readings = exact_readings(simulation);
    bag.write(Telemetry(simulation.scene().robot.rollers, readings.phi, {}), simulation, readings, 0);
  }
  EXPECT_FALSE(folder.has("x.bag"));
  EXPECT_FALSE(folder.has("x.bag.part"));
}

TEST(BagWriter, names_the_file_that_cannot_be_written) {
  try {
    BagWriter bag("/nowhere/x.bag");
    FAIL() << "must throw";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/x.bag"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace youbot_base_sim
