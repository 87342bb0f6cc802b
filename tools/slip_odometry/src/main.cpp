// Odometry of a Mecanum base from the angles of its wheels alone, by the dynamics: rollers, their friction, slip.

#include <diagnostic_updater/diagnostic_updater.h>
#include <fmt/format.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <std_srvs/Trigger.h>
#include <tf2_ros/transform_broadcaster.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <set>
#include <sstream>
#include <string>

#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/ros/program.h"
#include "youbot_base_sim/slip_odometry/slip_odometry.h"
#include "youbot_base_sim/slip_odometry/wheel_stream.h"

namespace {

using namespace youbot_base_sim;

constexpr char kHelp[] =
    "slip_odometry [_PARAMETER:=VALUE ..] [joint_states:=TOPIC]\n"
    "Publishes slip_odom, odometry of a Mecanum base that accounts for slip, from the positions in joint_states.\n\n"
    "Parameters and defaults:\n"
    "  ~scene           YAML of robot and floor, as by identify; without it the profile `measured`\n"
    "  ~profile         paper, measured, measured_a or measured_b, replaces the scene's; ~friction_scale: of measured\n"
    "  ~joints          \"wheel_joint_fl wheel_joint_fr wheel_joint_bl wheel_joint_br\"\n"
    "  ~joint_signs     \"1 1 1 1\": of positions, 1 forward or -1; ~publisher: the node whose joint_states count\n"
    "  ~ticks_per_turn  0: positions in rad; else encoder ticks of a turn\n"
    "  ~angles_at_zero  list of the wheels' angles where positions are 0, rad; without it they are searched\n"
    "  ~replicas        4, 1 to 100: simulations where neither these nor efforts are known\n"
    "  ~wheel_error     relative error of a wheel's path, which identify prints; left out: 0.012, 0.005 with angles\n"
    "  ~max_gap         0.5 s; ~max_wheel_rate: 30 rad/s; ~max_effort_error: 1 N m; beyond, a reading is doubtful\n"
    "  ~odom_frame      odom; ~base_frame: base_footprint; ~publish_tf: false\n"
    "Service ~reset sets the pose to zero. Doubts are in /diagnostics. docs/estimation.md says more.\n";

constexpr double kTolerance = 1e-4;  // with less, a minute of driving differs by 30 micrometres
constexpr double kMaxReplicas = 100;
constexpr double kReportPeriod = 1;        // s
constexpr std::uint32_t kQueueSize = 100;  // of readings: two seconds of the driver's

/// Exactly four words, else ParameterError.
std::array<std::string, kWheels> four_words(const Parameters& parameters, const std::string& name,
                                            const std::string& text) {
  std::istringstream stream(text);
  std::array<std::string, kWheels> words;
  std::string more;
  for (std::string& word : words) stream >> word;
  parameters.require(!words.back().empty() && !(stream >> more), name, text, "four words: of wheels fl, fr, bl, br");
  return words;
}

WheelStream read_encoders(Parameters& parameters) {
  std::string joints, signs = "1 1 1 1";
  for (int i = 0; i < kWheels; ++i) joints += (i > 0 ? " " : "") + wheel_joint(i);
  double ticks = 0;
  WheelStream wheels;
  parameters.read("joints", joints);
  parameters.read("joint_signs", signs);
  parameters.read("ticks_per_turn", ticks, {1, 1e9, "", true});
  parameters.read("publisher", wheels.publisher);
  wheels.joints = four_words(parameters, "joints", joints);
  if (ticks > 0) wheels.rad_per_unit *= 2 * M_PI / ticks;
  const std::set<std::string> different(wheels.joints.begin(), wheels.joints.end());
  parameters.require(different.size() == kWheels, "joints", joints, "four different joints");
  const auto words = four_words(parameters, "joint_signs", signs);
  for (int i = 0; i < kWheels; ++i) {
    const std::string& sign = words[static_cast<std::size_t>(i)];
    parameters.require(sign == "1" || sign == "-1", "joint_signs", signs, "four of 1 and -1");
    if (sign == "-1") wheels.rad_per_unit[i] *= -1;
  }
  return wheels;
}

/// One that slips. Throws ParameterError.
Scene read_slipping_scene(Parameters& parameters) {
  const Scene scene = read_scene(parameters, {{"solver.relative_tolerance", kTolerance}});
  if (!slips(scene.model)) throw ParameterError("parameter ~scene: model = no_slip: must be one with slip");
  return scene;
}

SlipOdometry::Settings read_settings(Parameters& parameters) {
  SlipOdometry::Settings settings;
  double replicas = settings.replicas;
  parameters.read("wheel_error", settings.wheel_error, Range{1e-6, 1, ""});
  parameters.read("max_gap", settings.max_gap, {1e-3, 10, "s"});
  parameters.read("max_wheel_rate", settings.max_rate, {1e-3, 1e3, "rad/s"});
  parameters.read("max_effort_error", settings.max_effort_error, {1e-3, 1e6, "N m"});
  parameters.read("angles_at_zero", settings.angles_at_zero, kWheelAngles);
  parameters.read("replicas", replicas, {1, kMaxReplicas, ""});
  parameters.require(replicas == std::floor(replicas), "replicas", fmt::format("{:g}", replicas), "a whole number");
  settings.replicas = static_cast<int>(replicas);
  return settings;
}

std::string text_of(const Wheels& w) { return fmt::format("{:.3g}, {:.3g}, {:.3g}, {:.3g}", w[0], w[1], w[2], w[3]); }

/// Publishes odometry for each message of joint_states that has all four wheels.
class SlipOdometryNode {
 public:
  /// Throws ParameterError.
  SlipOdometryNode() {
    ros::NodeHandle private_node("~");
    Parameters parameters(private_node, "~");
    const SlipOdometry::Settings settings = read_settings(parameters);
    wheels_ = read_encoders(parameters);
    wheels_.max_rate = settings.max_rate;
    const Scene scene = read_slipping_scene(parameters);
    parameters.read("odom_frame", odom_frame_);
    parameters.read("base_frame", base_frame_);
    parameters.read("publish_tf", publish_tf_);
    parameters.refuse_others();
    odometry_.emplace(scene, settings);
    publisher_ = node_.advertise<nav_msgs::Odometry>("slip_odom", kQueueSize);
    readings_ =
        node_.subscribe("joint_states", kQueueSize, &SlipOdometryNode::take, this, ros::TransportHints().tcpNoDelay());
    reset_ = private_node.advertiseService("reset", &SlipOdometryNode::reset, this);
    diagnostics_.setHardwareID("wheels");
    diagnostics_.add("slip odometry", this, &SlipOdometryNode::report);
  }

 private:
  void take(const ros::MessageEvent<const sensor_msgs::JointState>& event) {
    const sensor_msgs::JointState& message = *event.getMessage();
    const ros::Time& stamp = message.header.stamp;
    const auto reading = wheels_.read(event.getPublisherName(), time_of(stamp), message.name, message.position,
                                      message.velocity, message.effort);
    if (!wheels_.finding().empty()) ROS_WARN_STREAM(wheels_.finding());
    if (!reading) return;
    odometry_->update(time_of(stamp), reading->phi, reading->torque, reading->dphi);
    if (const std::string& doubt = odometry_->doubt(); !doubt.empty()) {
      // The first one: others may follow from it.
      if (++doubts_ == 1) doubt_ = fmt::format("{} (t = {:.3f} s)", doubt, time_of(stamp));
      ROS_WARN_STREAM_THROTTLE(5, doubt);
    }
    ++taken_;
    note_angles();
    publish(stamp);
    report_in_time();
  }

  /// Seconds of the wall clock: /clock may stand still or go back.
  void report_in_time() {
    const ros::WallTime now = ros::WallTime::now();
    if ((now - reported_).toSec() < kReportPeriod) return;
    reported_ = now;
    diagnostics_.force_update();
  }

  /// Says which angles would be found again, as long as the encoders stay switched on.
  void note_angles() {
    const std::optional<PhaseSearch>& search = odometry_->search();
    const std::string angles = search && search->found() ? text_of(search->phases(0)) : "";
    if (angles != angles_at_zero_ && !angles.empty())
      ROS_INFO("efforts tell ~angles_at_zero: [%s], sigma [%s]", angles.c_str(), text_of(search->sigma()).c_str());
    angles_at_zero_ = angles;
  }

  void publish(const ros::Time& stamp) {
    nav_msgs::Odometry message = odometry_message(odom_frame_, odometry_->pose(), odometry_->velocity(), stamp);
    message.child_frame_id = base_frame_;
    message.pose.covariance = covariance_message(odometry_->pose_covariance());
    message.twist.covariance = covariance_message(odometry_->velocity_covariance());
    publisher_.publish(message);
    if (publish_tf_) transforms_.sendTransform(transform_message(odom_frame_, base_frame_, odometry_->pose(), stamp));
  }

  bool reset(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
    odometry_->reset();
    response.success = true;
    response.message = "the pose is zero";
    return true;
  }

  void report(diagnostic_updater::DiagnosticStatusWrapper& status) {
    if (taken_ == 0) {
      status.summary(status.WARN, "no message of joint_states with all four wheels");
    } else if (doubts_ > 0) {
      status.summaryf(status.WARN, "%d of the last %d readings do not tell where the base is: %s", doubts_, taken_,
                      doubt_.c_str());
    } else {
      status.summary(status.OK, "follows the encoders");
    }
    status.add("readings", taken_);
    status.add("doubtful", doubts_);
    status.add("signs of efforts (0: unknown)", text_of(odometry_->effort_signs()));
    status.add("velocities over changes of positions (0: unused)", text_of(odometry_->rate_factors()));
    if (odometry_->search()) status.add("angles at zero that efforts tell", angles_at_zero_);
    taken_ = doubts_ = 0;
  }

  ros::NodeHandle node_;
  WheelStream wheels_;
  std::optional<SlipOdometry> odometry_;
  std::string odom_frame_ = kOdometryFrame, base_frame_ = kBaseFrame;
  std::string angles_at_zero_;  // empty: not known
  std::string doubt_;           // the first since the last report
  bool publish_tf_ = false;
  int taken_ = 0, doubts_ = 0;  // since the last report
  ros::WallTime reported_;
  ros::Publisher publisher_;
  ros::Subscriber readings_;
  ros::ServiceServer reset_;
  tf2_ros::TransformBroadcaster transforms_;
  diagnostic_updater::Updater diagnostics_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && argv[1] == std::string("--help")) return std::fputs(kHelp, stdout) < 0 || std::fflush(stdout) != 0;
  return run_program(argc, argv, "slip_odometry", [] {
    const SlipOdometryNode node;
    ros::spin();
  });
}
