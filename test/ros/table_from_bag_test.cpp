// scripts/table_from_bag: tables of what a bag tells, which simulate replays.

#include <brics_actuator/JointTorques.h>
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>

#include <filesystem>
#include <functional>

#include "errors.h"
#include "program.h"
#include "youbot_base_sim/loop/base_loop.h"
#include "youbot_base_sim/ros/bag.h"

namespace youbot_base_sim {
namespace {

constexpr double kPeriod = 1e-3;     // s
constexpr double kWallTime = 1.7e9;  // s, of a recorder's clock
constexpr double kDuration = 2;      // s

LoopSettings node_settings() {
  LoopSettings settings;
  settings.scene.solver.control_period = kPeriod;
  settings.scene.solver.relative_tolerance = 1e-6;
  settings.scene.solver.absolute_tolerance = 1e-9;
  return settings;
}

class TableFromBagTest : public ::testing::Test {
 protected:
  /// Runs the script; returns its exit status.
  int make_table(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {TABLE_FROM_BAG, folder_.path("x.bag")});
    Program program(PYTHON, arguments);
    const int status = program.wait();
    said_ = program.out() + program.err();
    return status;
  }

  void expect_refused(const std::vector<std::string>& arguments, const std::vector<std::string>& words) {
    EXPECT_EQ(make_table(arguments), 2);
    expect_words(said_, words);
    EXPECT_FALSE(folder_.has("table.csv"));
  }

  WheelTable table() {
    const Scene scene = load_scene(folder_.write("table.yaml", "duration: 1\ndrive: {velocity_table: table.csv}\n"));
    return std::get<VelocityTable>(scene.drive).table;
  }

  /// Simulates a scene of the robot with a table for its drive.
  State replay(const std::string& drive) {
    const Scene scene =
        load_scene(folder_.write("replay.yaml",
                                 "duration: 2\nsolver: {relative_tolerance: 1e-6, absolute_tolerance: 1e-9}\n"
                                 "motors: {quantized: true}\ndrive: {" +
                                     drive + ": table.csv}\n"));
    Simulation simulation(scene);
    simulation.advance_to(kDuration);
    return simulation.state();
  }

  static void expect_same(const State& a, const State& b) {
    EXPECT_LT((a.values.col(0) - b.values.col(0)).abs().maxCoeff(), 1e-6);
  }

  /// A bag like a recorder's, whose messages arrive at `times`, s.
  template <class Message>
  void record(const std::string& topic, const std::vector<std::pair<double, Message>>& messages) {
    rosbag::Bag bag(folder_.path("x.bag"), rosbag::bagmode::Write);
    geometry_msgs::Twist first;
    bag.write("/something", ros::Time(kWallTime), first);
    for (const auto& [t, message] : messages) bag.write(topic, ros::Time(kWallTime) + ros::Duration(t), message);
  }

  /// A base that has driven for two seconds, whose joint states and wheel rates were recorded.
  State drive_and_record(bool driver_velocity_sign) {
    LoopSettings settings = node_settings();
    Telemetry::Options options;
    options.driver_velocity_sign = driver_velocity_sign;
    settings.publish_rate = 1 / kPeriod;
    BaseLoop loop(settings);
    Telemetry telemetry(settings.scene, options);
    loop.push(0, drive_command(DriveMode::kVelocity, DriverKinematics().wheel_rates({0.2, 0.1, 0.3})));
    BagWriter bag(OutputFile(folder_.path("x.bag"), OutputFile::Access::kAnywhere));
    for (int k = 0; k * kPeriod < kDuration; ++k) {
      bag.write(telemetry, loop.simulation(), loop.sensors(), loop.time());
      loop.advance_periods(1);
      loop.meet_instant();
      rates_.push_back(loop.simulation().state().dphi());
      torques_.push_back(loop.simulation().torque());
    }
    bag.commit();
    return loop.simulation().state();
  }

  TemporaryFolder folder_;
  std::string said_;
  const std::vector<std::string> velocity_ = {"--velocity", folder_.path("table.csv")},
                                 torque_ = {"--torque", folder_.path("table.csv")};
  std::vector<Wheels> rates_, torques_;  // at the end of each control period
};

TEST_F(TableFromBagTest, ReplaysTwists) {
  std::vector<std::pair<double, geometry_msgs::Twist>> messages;
  BaseLoop loop(node_settings());
  for (const Eigen::Vector3d& velocity :
       {Eigen::Vector3d(0.2, 0, 0), Eigen::Vector3d(0.2, 0, 0), Eigen::Vector3d(-0.1, 0.15, 0.4)}) {
    geometry_msgs::Twist twist;
    twist.linear.x = velocity[0];
    twist.linear.y = velocity[1];
    twist.angular.z = velocity[2];
    const double t = 0.1 + 0.5 * static_cast<double>(messages.size());
    messages.emplace_back(t, twist);
    loop.push(t, wheel_command(twist, DriverKinematics()).set_points);
  }
  messages.emplace_back(1.7, messages[0].second);
  messages.back().second.linear.x = NAN;
  record("cmd_vel", messages);  // as `rosbag record cmd_vel` names it
  ASSERT_EQ(make_table(velocity_), 0) << said_;
  EXPECT_NE(said_.find("cmd_vel: twist of 1 messages is not finite"), std::string::npos) << said_;
  EXPECT_EQ(table().t.size(), 2u) << "the same again is no row";
  loop.advance_periods(2000);
  expect_same(replay("velocity_table"), loop.simulation().state());
}

// The wheels' angles alone, in either convention of the velocities, which do not matter.
TEST_F(TableFromBagTest, ReplaysWheelAngles) {
  const State end = drive_and_record(true);
  expect_refused({"--angles", folder_.path("other.csv"), "--joints=a,b,c,d"},
                 {"has the joints", "not the wheels a, b, c, d"});
  expect_refused({"--angles", folder_.path("other.csv"), "--measured", "--velocity", "v.csv"}, {"--angles FILE alone"});
  ASSERT_EQ(make_table({"--angles", folder_.path("table.csv")}), 0) << said_;
  Simulation simulation(
      load_scene(folder_.write("replay.yaml", "duration: 1.99\ndrive: {wheel_angle_table: table.csv}\n")));
  simulation.advance_to(1.99);
  EXPECT_LT((simulation.state().phi() - end.phi()).abs().maxCoeff(), 0.3) << "10 ms later";
  EXPECT_NEAR(simulation.state().x(), end.x(), 0.005);
  EXPECT_NEAR(simulation.state().psi(), end.psi(), 0.01);
}

TEST_F(TableFromBagTest, ReplaysTorques) {
  std::vector<std::pair<double, brics_actuator::JointTorques>> messages;
  BaseLoop loop(node_settings());
  for (const double torque : {0.8, 5.0, -0.5}) {
    messages.emplace_back(0.5 * static_cast<double>(messages.size()),
                          torque_message(Wheels(torque, 0.9, 0.7, 1.1), ros::Time()));
  }
  messages[1].second.torques.pop_back();  // br keeps its torque
  messages[2].second.torques[0].unit = "Nm";
  for (const auto& [t, message] : messages) loop.push(t, wheel_command(message).set_points);
  record("/base/base_controller/torques_command", messages);
  ASSERT_EQ(make_table(torque_), 0) << said_;
  EXPECT_NE(said_.find("wheel_joint_fl of 1 messages has the unit \"Nm\""), std::string::npos) << said_;
  loop.advance_periods(2000);
  expect_same(replay("torque_table"), loop.simulation().state());
}

TEST_F(TableFromBagTest, MeasuredVelocitiesGoForwardWhicheverSignTheyWereRecordedWith) {
  const Motor motor;
  for (const bool driver_exact : {false, true}) {
    rates_.clear();
    drive_and_record(driver_exact);
    std::vector<std::string> arguments = velocity_;
    arguments.emplace_back("--measured");
    ASSERT_EQ(make_table(arguments), 0) << said_;
    EXPECT_EQ(said_.find("have the driver's opposite sign") != std::string::npos, driver_exact) << said_;
    const WheelTable measured = table();
    ASSERT_EQ(measured.t.size(), rates_.size());
    for (std::size_t k = 1; k < rates_.size(); ++k) {
      EXPECT_NEAR(measured.t[k], static_cast<double>(k) * kPeriod, 1e-9);
      EXPECT_LE((measured.values[k] - rates_[k - 1]).abs().maxCoeff(), 0.5001 * motor.rpm());
    }
  }
}

// The torques that made the motion make it again: what is lost is half a mA of each.
TEST_F(TableFromBagTest, MeasuredTorquesMakeTheMotionAgain) {
  const State driven = drive_and_record(true);
  std::vector<std::string> arguments = torque_;
  arguments.emplace_back("--measured");
  ASSERT_EQ(make_table(arguments), 0) << said_;
  const State again = replay("torque_table");
  const double way = std::hypot(driven.x(), driven.y());
  EXPECT_GT(way, 0.3);
  EXPECT_LT(std::hypot(again.x() - driven.x(), again.y() - driven.y()), 0.02 * way);
}

TEST_F(TableFromBagTest, RefusesInOneLineThatSaysWhy) {
  expect_refused(velocity_, {"x.bag", "No such file"});
  folder_.write("x.bag", "something else");
  expect_refused(velocity_, {"x.bag is not a bag"});
  { rosbag::Bag bag(folder_.path("x.bag"), rosbag::bagmode::Write); }
  expect_refused(velocity_, {"x.bag has no messages"});
  expect_refused({}, {"or --angles FILE alone"});

  geometry_msgs::Twist twist;
  record<geometry_msgs::Twist>("/cmd_vel", {{0, twist}});
  expect_refused(
      torque_, {"no torques_command (brics_actuator/JointTorques); it has /cmd_vel (geometry_msgs/Twist), /something"});
  expect_refused({velocity_[0], velocity_[1], "--topic", "/cmd"},
                 {"--topic /cmd: must be a topic of a base; it has /cmd_vel"});
  expect_refused({velocity_[0], velocity_[1], "--measured"}, {"no joint_states (sensor_msgs/JointState); it has"});
}

TEST_F(TableFromBagTest, RefusesOutputsThatWouldDestroySomething) {
  folder_.write("x.bag", "what is read\n");
  const std::string bag = folder_.path("x.bag"), table = folder_.path("table.csv");
  expect_refused({"--velocity", bag}, {"--velocity", "x.bag", "must not be a file that is read"});
  expect_refused({"--velocity", folder_.path("./x.bag")}, {"--velocity", "must not be a file that is read"});
  expect_refused({"--velocity", table, "--torque", table}, {"--torque", "table.csv", "the file of --velocity"});
  expect_refused({"--velocity", "", "--torque", table}, {"--velocity", "must not be empty"});
  EXPECT_EQ(folder_.read("x.bag"), "what is read\n");
}

TEST_F(TableFromBagTest, ChecksEveryOutputBeforeItWritesOne) {
  drive_and_record(false);
  const std::string bag = folder_.read("x.bag"), table = folder_.path("table.csv");
  const std::filesystem::path link = folder_.path("link.csv");
  std::filesystem::create_symlink("x.bag", link);
  expect_refused({"--measured", "--velocity", table, "--torque", link},
                 {"--torque", "link.csv", "a file that is read"});
  expect_refused({"--measured", "--velocity", table, "--torque", folder_.path("none/t.csv")},
                 {"none/t.csv: cannot be written: No such file or directory"});
  expect_refused({"--measured", "--velocity", table, "--torque", folder_.path(".")}, {"Is a directory"});
  EXPECT_EQ(folder_.read("x.bag"), bag);
}

TEST_F(TableFromBagTest, WhereAnOutputTakesNoMoreTheExitStatusIs1) {
  drive_and_record(false);
  const std::string no_space = "cannot be written: no space left for it (No space left on device)\n";
  EXPECT_EQ(make_table({"--measured", "--velocity", "/dev/full"}), 1);
  EXPECT_NE(said_.find("table_from_bag: /dev/full: " + no_space), std::string::npos) << said_;
  Program shell("/bin/sh", {"-c", R"("$0" "$@" > /dev/full)", PYTHON, TABLE_FROM_BAG, folder_.path("x.bag"),
                            "--measured", "--velocity", folder_.path("table.csv")});
  EXPECT_EQ(shell.wait(), 1);
  EXPECT_EQ(shell.err(), "table_from_bag: standard output: " + no_space);
  EXPECT_EQ(table().t.size(), rates_.size()) << "the table is whole all the same";
}

TEST_F(TableFromBagTest, RefusesTextsThatAreEmpty) {
  const std::string table = folder_.path("table.csv");
  expect_refused({"--velocity", table, "--torque", ""}, {"--torque = \"\": must not be empty"});
  expect_refused({"--velocity", table, "--topic", ""}, {"--topic: '': must be NAME=TOPIC"});
  expect_refused({"--velocity", table, "--wheel-radius", ""}, {"--wheel-radius: '': must be a number > 0"});
}

TEST_F(TableFromBagTest, OfABagThatIsCutTheTableHasWhatCanBeRead) {
  std::vector<std::pair<double, geometry_msgs::Twist>> messages(3);
  for (int k = 0; k < 3; ++k) {
    messages[k].first = k;
    messages[k].second.linear.x = 0.1 * (k + 1);
  }
  record("/cmd_vel", messages);
  const std::string whole = folder_.read("x.bag");
  const double last = messages.back().second.linear.x;
  const std::size_t within_last = whole.find(std::string(reinterpret_cast<const char*>(&last), sizeof last));
  for (const auto& [size, rows] : {std::pair(whole.size() - 20, 3u), std::pair(within_last, 2u)}) {
    folder_.write("x.bag", whole.substr(0, size));
    EXPECT_EQ(make_table(velocity_), 0) << said_;
    expect_words(said_, {"table_from_bag: warning: " + folder_.path("x.bag") + " has no complete index"});
    EXPECT_EQ(table().t.size(), rows) << said_;
  }
}

TEST_F(TableFromBagTest, RefusesTwoRunsInOneBag) {
  const geometry_msgs::Twist twist;
  record<geometry_msgs::Twist>("/cmd_vel", {{0, twist}, {1, twist}, {2, twist}, {0.5, twist}, {1, twist}});
  expect_refused(velocity_, {"x.bag: the times of /cmd_vel go back from t = 2.000 s to 0.500 s: must be one run"});

  std::vector<std::pair<double, sensor_msgs::JointState>> messages(8);
  for (std::size_t k = 0; k < messages.size(); ++k) {
    auto& [arrival, message] = messages[k];
    arrival = 0.1 * static_cast<double>(k);
    message.header.stamp = ros::Time(kWallTime) + ros::Duration(0.1 * static_cast<double>(k % 4));
    for (int i = 0; i < kWheels; ++i) {
      message.name.push_back(wheel_joint(i));
      message.position.push_back(arrival);
      message.velocity.push_back(1);
    }
  }
  record("/joint_states", messages);
  expect_refused({"--measured", velocity_[0], velocity_[1]}, {"/joint_states go back from t = 0.300 s to 0.000 s"});
}

TEST_F(TableFromBagTest, RefusesABaseThatWasPutElsewhere) {
  const geometry_msgs::Twist twist;
  const auto put_at = [&](const std::string& topic, double t) {
    record<geometry_msgs::Twist>("/a/cmd_vel", {{0, twist}, {1, twist}});
    rosbag::Bag(folder_.path("x.bag"), rosbag::bagmode::Append)
        .write(topic, ros::Time(kWallTime) + ros::Duration(t), nav_msgs::Odometry());
    rosbag::Bag(folder_.path("x.bag"), rosbag::bagmode::Append)
        .write("/a/cmd_vel", ros::Time(kWallTime) + ros::Duration(2), twist);
    return std::vector<std::string>{velocity_[0], velocity_[1], "--topic", "/a/cmd_vel"};
  };
  expect_refused(put_at("/a/state_set", 1.5),
                 {"x.bag: the base was put elsewhere at t = 1.500 s, by /a/state_set: must be one run"});
  expect_refused(put_at("state_set", 1.5), {"t = 1.500 s, by state_set"});
  EXPECT_EQ(make_table(put_at("/b/state_set", 1.5)), 0) << said_;
}

TEST_F(TableFromBagTest, RefusesWhatNoOneTableCanTell) {
  rosbag::Bag bag(folder_.path("x.bag"), rosbag::bagmode::Write);
  bag.write("/cmd_vel", ros::Time(1), geometry_msgs::Twist());
  bag.write("/base/base_controller/torques_command", ros::Time(2), torque_message(Wheels::Ones(), ros::Time()));
  bag.close();
  expect_refused(velocity_, {"torques_command too", "--topic"});
  EXPECT_EQ(make_table({velocity_[0], velocity_[1], "--topic", "/cmd_vel"}), 0) << said_;
}

TEST_F(TableFromBagTest, RefusesJointStatesThatDoNotTell) {
  const auto states = [&](const std::function<void(sensor_msgs::JointState&)>& change) {
    std::vector<std::pair<double, sensor_msgs::JointState>> messages;
    for (int k = 0; k < 3; ++k) {
      sensor_msgs::JointState message;
      for (int i = 0; i < kWheels; ++i) {
        message.name.push_back(wheel_joint(i));
        message.position.push_back(k);
        message.velocity.push_back(1);
      }
      change(message);
      messages.emplace_back(k, message);
    }
    record("/joint_states", messages);
  };
  const auto with = [](std::vector<std::string> arguments, const std::string& more) {
    arguments.push_back(more);
    return arguments;
  };
  states([](auto&) {});
  expect_refused(with(torque_, "--measured"), {"/joint_states has no effort"});
  states([](auto& message) { message.position.assign(kWheels, 0.0); });
  EXPECT_EQ(make_table(with(velocity_, "--measured")), 2);
  EXPECT_NE(said_.find("no wheel turns"), std::string::npos) << said_;
  EXPECT_NE(said_.find("give --joint-velocity-sign"), std::string::npos) << said_;
  const auto expect_read = [&](const std::string& words) {
    EXPECT_EQ(make_table(with(velocity_, "--measured")), 0);
    EXPECT_NE(said_.find(words), std::string::npos) << said_;
    for (const Wheels& rates : table().values) EXPECT_TRUE(rates.isApprox(Wheels::Ones())) << words;
  };
  states([](auto& message) { message.velocity[0] = -1; });
  expect_read("warning: " + folder_.path("x.bag") + ": /joint_states: velocities of fl have the opposite sign");
  states([](auto& message) { message.velocity[2] = NAN; });
  expect_read("/joint_states: velocity of 3 messages is not finite");
}

}  // namespace
}  // namespace youbot_base_sim
