// What launch files start: the node in the place of the driver, with a description of the user's own, two robots.

#include <diagnostic_msgs/DiagnosticArray.h>
#include <ros/master.h>
#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <map>

#include "base_client.h"
#include "frame_tree.h"

namespace youbot_base_sim {
namespace {

/// launch/youbot_driver.launch puts the node where the real driver's launch file puts the driver: same names, types,
/// rates.
class DriverLaunch : public ::testing::Test {
 protected:
  template <class Message>
  boost::shared_ptr<const Message> receive(const std::string& topic) {
    const auto message = ros::topic::waitForMessage<Message>(topic, ros::Duration(20));
    if (!message) throw std::runtime_error("nothing on " + topic);
    return message;
  }

  ros::NodeHandle node_;
};

TEST_F(DriverLaunch, node_and_services_have_the_drivers_names) {
  receive<nav_msgs::Odometry>("/odom");
  std::vector<std::string> nodes;
  ASSERT_TRUE(ros::master::getNodes(nodes));
  EXPECT_EQ(std::count(nodes.begin(), nodes.end(), "/youbot_driver"), 1);
  EXPECT_EQ(std::count(nodes.begin(), nodes.end(), "/robot_state_publisher"), 1);
  for (const char* service : {"/base/switchOffMotors", "/base/switchOnMotors", "/reconnect"}) {
    EXPECT_TRUE(ros::service::exists(service, true)) << service;
    std_srvs::Empty call;
    EXPECT_TRUE(call_service(service, call)) << service;
  }
}

TEST_F(DriverLaunch, parameters_are_those_of_the_drivers_launch_file) {
  double frequency = 0;
  bool has_base = false;
  std::string name, text;
  EXPECT_TRUE(ros::param::get("/youBotDriverCycleFrequencyInHz", frequency));
  EXPECT_EQ(frequency, 40);
  EXPECT_TRUE(ros::param::get("/youBotHasBase", has_base));
  EXPECT_TRUE(has_base);
  EXPECT_TRUE(ros::param::get("/youBotBaseName", name));
  EXPECT_EQ(name, "youbot-base");
  for (const char* parameter :
       {"/youBotHasArms", "/youBotConfigurationFilePath", "/robot_description", "/trajectoryActionServerEnable",
        "/trajectoryPositionGain", "/trajectoryVelocityGain"}) {
    EXPECT_TRUE(ros::param::has(parameter)) << parameter;
  }
}

TEST_F(DriverLaunch, misses_the_arm_that_it_was_to_have) {
  const auto diagnostics = receive<diagnostic_msgs::DiagnosticArray>("/diagnostics");
  for (const auto& status : diagnostics->status) {
    EXPECT_EQ(status.level == status.ERROR, status.name == "platform_Arm") << status.name;
  }
}

TEST_F(DriverLaunch, joint_states_are_the_drivers) {
  const auto joints = receive<sensor_msgs::JointState>("/joint_states");
  const std::vector<std::string> names = {"wheel_joint_fl",  "wheel_joint_fr",  "wheel_joint_bl",  "wheel_joint_br",
                                          "caster_joint_fl", "caster_joint_fr", "caster_joint_bl", "caster_joint_br"};
  EXPECT_EQ(joints->name, names);
  EXPECT_EQ(joints->position.size(), 8u);
  EXPECT_EQ(joints->velocity.size(), 8u);
  EXPECT_EQ(joints->header.frame_id, "");
}

TEST_F(DriverLaunch, odometry_and_transform_are_of_one_instant) {
  std::map<ros::Time, nav_msgs::Odometry> odometry;
  std::map<ros::Time, geometry_msgs::TransformStamped> transforms;
  const ros::Subscriber odom = node_.subscribe<nav_msgs::Odometry>(
      "/odom", 1000, [&](const auto& message) { odometry[message->header.stamp] = *message; });
  const ros::Subscriber tf = node_.subscribe<tf2_msgs::TFMessage>("/tf", 1000, [&](const auto& message) {
    for (const auto& transform : message->transforms) {
      if (transform.child_frame_id == "base_footprint") transforms[transform.header.stamp] = transform;
    }
  });
  wait_for("52 of each", [&] { return odometry.size() >= 52 && transforms.size() >= 52; });
  // 40 Hz by their stamps, which go by simulated instants on the wall clock; time that is lost to a busy machine counts
  // once for each message at most.
  std::vector<double> gaps;
  for (auto next = std::next(odometry.begin()); next != odometry.end(); ++next) {
    gaps.push_back((next->first - std::prev(next)->first).toSec());
  }
  std::sort(gaps.begin(), gaps.end());
  EXPECT_NEAR(gaps[gaps.size() / 2], 0.025, 1e-6);
  int both = 0;
  for (const auto& [stamp, transform] : transforms) {
    const auto found = odometry.find(stamp);
    if (found == odometry.end()) continue;
    ++both;
    EXPECT_EQ(transform.header.frame_id, "odom");
    EXPECT_EQ(found->second.header.frame_id, "odom");
    EXPECT_EQ(found->second.child_frame_id, "base_footprint");
    EXPECT_EQ(transform.transform.translation.x, found->second.pose.pose.position.x);
    for (const double covariance : found->second.pose.covariance) EXPECT_EQ(covariance, 0);
  }
  EXPECT_GT(both, 40);
}

TEST_F(DriverLaunch, robot_state_publisher_knows_the_wheels) {
  FrameTree frames;
  frames.listen();
  wait_for("a wheel", [&] { return frames.has("wheel_link_br"); });
  for (const char* wheel : kWheelNames) EXPECT_TRUE(frames.has(std::string("wheel_link_") + wheel)) << wheel;
}

// A description of the user's own, with arm, gripper and laser, stays, and the frames of all its links hang on odom
// once rostopic publishes their joints beside those of the base.
TEST(OwnDescription, is_kept_and_its_frames_are_one_tree) {
  ros::NodeHandle node;
  FrameTree frames;
  frames.listen();
  const std::set<std::string> last = {"base_footprint", "wheel_link_br", "base_laser_front_link", "arm_link_2",
                                      "gripper_finger_link_l"};
  wait_for("all links", [&] {
    return std::all_of(last.begin(), last.end(), [&](const std::string& link) { return frames.has(link); });
  });
  frames.expect_whole("odom");
  std::string description;
  ASSERT_TRUE(node.getParam("/robot_description", description));
  EXPECT_NE(description.find("arm_joint_2"), std::string::npos);
}

/// What is heard of one robot, whose namespace is its frames' prefix.
class Robot {
 public:
  explicit Robot(const std::string& name) : name_(name), node_("/" + name) {
    const auto keep = [this](const auto& message) { frames_.insert(message->header.frame_id); };
    subscribers_ = {node_.subscribe<nav_msgs::Odometry>("ground_truth", 10, [this](const auto& m) { truth = *m; }),
                    node_.subscribe<nav_msgs::Odometry>("odom", 10, [this](const auto& m) { odometry = *m; }),
                    node_.subscribe<ContactsStamped>("contacts", 10, keep),
                    node_.subscribe<RollerSwitchStamped>("base/roller_switches", 10, keep),
                    node_.subscribe<visualization_msgs::MarkerArray>("contact_markers", 10, [this](const auto& m) {
                      for (const auto& marker : m->markers) frames_.insert(marker.header.frame_id);
                    })};
    wait_for("the robot to listen and speak", [this] {
      return commands_.getNumSubscribers() == 1 && !truth.header.stamp.isZero() && !odometry.header.stamp.isZero();
    });
  }

  /// Commands for so much simulated time, s, from when the base follows: a busy machine delivers the command late.
  /// Returns the path forward in that time, m.
  double drive(double v_x, double duration) {
    commands_.publish(twist(v_x, 0, 0));
    wait_for("the base to follow", [&] { return std::abs(truth.twist.twist.linear.x - v_x) < 0.05; });
    const double start = truth.pose.pose.position.x;
    const ros::Time end = truth.header.stamp + ros::Duration(duration);
    wait_for("time to pass", [&] { return truth.header.stamp >= end; });
    return truth.pose.pose.position.x - start;
  }

  void expect_own_frames() const {
    EXPECT_EQ(odometry.header.frame_id, name_ + "/odom");
    EXPECT_EQ(odometry.child_frame_id, name_ + "/base_footprint");
    EXPECT_EQ(truth.header.frame_id, "world");
    EXPECT_EQ(truth.child_frame_id, name_ + "/base_footprint");
    EXPECT_GE(frames_.size(), 2u);
    for (const std::string& frame : frames_) EXPECT_EQ(frame.rfind(name_ + "/", 0), 0u) << frame;
  }

  nav_msgs::Odometry odometry, truth;

 private:
  std::string name_;
  ros::NodeHandle node_;
  std::set<std::string> frames_;
  std::vector<ros::Subscriber> subscribers_;
  ros::Publisher commands_ = node_.advertise<geometry_msgs::Twist>("cmd_vel", 10);
};

// launch/two_robots.launch: two bases in one world, each with its own commands, by one clock, with one tree of frames.
TEST(TwoRobots, drive_alone_by_one_clock_in_one_tree) {
  FrameTree frames;
  frames.listen();
  Robot first("youbot_1"), second("youbot_2");
  EXPECT_GT(second.drive(0.3, 1), 0.2);
  EXPECT_NEAR(second.truth.pose.pose.position.y, -0.5, 0.01);
  EXPECT_EQ(first.truth.pose.pose.position.x, 0) << "is not commanded";
  EXPECT_EQ(first.truth.pose.pose.position.y, 0.5);

  second.drive(0, 0.5);
  const double before = second.truth.pose.pose.position.x;
  EXPECT_GT(first.drive(0.3, 1), 0.2);
  EXPECT_NEAR(second.truth.pose.pose.position.x, before, 0.01) << "is not commanded";
  wait_for("one clock",
           [&] { return std::abs((first.odometry.header.stamp - second.odometry.header.stamp).toSec()) <= 0.1; });

  for (const Robot* robot : {&first, &second}) robot->expect_own_frames();
  std::set<std::string> diagnosed;
  ros::NodeHandle node;
  const ros::Subscriber diagnostics = node.subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 10, [&](const auto& message) { diagnosed.insert(message->status.at(0).name); });
  wait_for("diagnostics of both", [&] { return diagnosed.size() == 2; });
  EXPECT_EQ(diagnosed, (std::set<std::string>{"youbot_1/platform_Base", "youbot_2/platform_Base"}));
  for (const std::string name : {"youbot_1/", "youbot_2/"}) {
    for (const std::string pose : {"", "ground_truth/"}) {
      wait_for("the wheels", [&] { return frames.has(name + pose + "wheel_link_br"); });
    }
  }
  frames.expect_whole("world");
}

}  // namespace
}  // namespace youbot_base_sim

int main(int argc, char** argv) { return youbot_base_sim::run_rostest(argc, argv); }
