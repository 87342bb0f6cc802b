#include "youbot_base_sim/identify/bag_reader.h"

#include <fmt/format.h>
#include <geometry_msgs/Twist.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/JointState.h>
#include <tf2/utils.h>

#include <algorithm>
#include <boost/algorithm/string/predicate.hpp>
#include <cmath>
#include <filesystem>
#include <variant>

#include "youbot_base_sim/identify/least_squares.h"
#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/text/quote.h"

namespace youbot_base_sim {

namespace {

/// Whether the topic has this name, in any namespace or, as rosbag record writes it on request, in none.
bool ends_with(const std::string& topic, const std::string& name) {
  return topic == name || boost::algorithm::ends_with(topic, "/" + name);
}

/// Falls back to the recorder's time of arrival where the stamp is missing or from another clock.
double time_of(const ros::Time& stamp, const ros::Time& arrival) {
  constexpr double kMaxApart = 1;  // s
  return std::abs((stamp - arrival).toSec()) < kMaxApart ? stamp.toSec() : arrival.toSec();
}

class Reader {
 public:
  explicit Reader(const std::string& path) { record_.name = quote_path(path); }

  void add(const rosbag::MessageInstance& message) {
    if (const auto joints = message.instantiate<sensor_msgs::JointState>()) add(*joints, message.getTime());
    const double t = message.getTime().toSec();
    if (const auto twist = message.instantiate<geometry_msgs::Twist>()) commands_.emplace_back(t, *twist);
    if (const auto rates = message.instantiate<brics_actuator::JointVelocities>()) commands_.emplace_back(t, *rates);
    if (const auto odometry = message.instantiate<nav_msgs::Odometry>()) {
      ends_with(message.getTopic(), kGroundTruthTopic) ? add_truth(*odometry, message.getTime())
                                                       : add_odometry(*odometry, message.getTime());
    }
  }

  DriveRecord finish() {
    if (record_.t.empty()) throw UnusableRecord(record_.name + ": no joint_states of the four wheels");
    add_commands(kinematics_of_odometry());
    const double start = record_.t.front();
    for (std::vector<double>* times : {&record_.t, &record_.commands.t, &record_.truth_t}) {
      for (double& t : *times) t -= start;
    }
    return std::move(record_);
  }

 private:
  void add(const sensor_msgs::JointState& joints, const ros::Time& arrival) {
    Wheels phi, dphi, torque;
    const std::size_t n = joints.name.size();
    const bool effort = joints.effort.size() == n;
    for (int i = 0; i < kWheels; ++i) {
      const auto found = std::find(joints.name.begin(), joints.name.end(), wheel_joint(i));
      const auto k = static_cast<std::size_t>(found - joints.name.begin());
      if (k == n || joints.position.size() != n || joints.velocity.size() != n) return;  // an arm's
      phi[i] = joints.position[k];
      dphi[i] = joints.velocity[k];
      torque[i] = effort ? joints.effort[k] : 0;
    }
    const double t = time_of(joints.header.stamp, arrival);
    if (!phi.isFinite().all() || !dphi.isFinite().all() || (!record_.t.empty() && t <= record_.t.back())) return;
    record_.t.push_back(t);
    record_.phi.push_back(phi);
    record_.dphi.push_back(dphi);
    record_.torque.push_back(torque.isFinite().all() ? torque : Wheels(Wheels::Zero()));
  }

  void add_truth(const nav_msgs::Odometry& message, const ros::Time& arrival) {
    const double t = time_of(message.header.stamp, arrival);
    if (!record_.truth_t.empty() && t <= record_.truth_t.back()) return;
    double heading = tf2::getYaw(message.pose.pose.orientation);
    if (!record_.truth.empty())
      heading = record_.truth.back()[2] + std::remainder(heading - record_.truth.back()[2], 2 * M_PI);
    record_.truth_t.push_back(t);
    record_.truth.emplace_back(message.pose.pose.position.x, message.pose.pose.position.y, heading);
  }

  void add_odometry(const nav_msgs::Odometry& message, const ros::Time& arrival) {
    const auto& v = message.twist.twist;
    const Eigen::Vector3d velocity(v.linear.x, v.linear.y, v.angular.z);
    if (velocity.allFinite()) odometry_.emplace_back(time_of(message.header.stamp, arrival), velocity);
  }

  /// The lengths with which odometry makes its velocities from the wheels' rates. Those are linear, and their
  /// coefficients follow from least squares, whatever signs the rates have: R / 4 forward and lateral, R / (4 h) in
  /// yaw.
  DriverKinematics kinematics_of_odometry() const {
    constexpr double kMinShare = 1e-3;  // of the rates' squares; directions below it are noise
    constexpr double kMinRadius = 0.01, kMaxRadius = 0.2, kMinLengths = 0.05, kMaxLengths = 2;  // m
    Eigen::Matrix4d squares = Eigen::Matrix4d::Zero();
    Eigen::Matrix<double, kWheels, 3> moments = Eigen::Matrix<double, kWheels, 3>::Zero();
    for (const auto& [t, velocity] : odometry_) {
      const auto joints = std::lower_bound(record_.t.begin(), record_.t.end(), t - kSameInstant);
      if (joints == record_.t.end() || *joints > t + kSameInstant) continue;
      const Wheels& rates = record_.dphi[static_cast<std::size_t>(joints - record_.t.begin())];
      squares += rates.matrix() * rates.matrix().transpose();
      moments += rates.matrix() * velocity.transpose();
    }
    // R, R, R / h; 0 of a motion that was never made
    Eigen::Vector3d sizes;
    for (int m = 0; m < 3; ++m) sizes[m] = 2 * solve_least_squares(squares, moments.col(m), kMinShare).norm();
    DriverKinematics kinematics;
    const double radius = std::max(sizes[0], sizes[1]);
    if (radius > kMinRadius && radius < kMaxRadius) kinematics.wheel_radius = 1e-4 * std::round(1e4 * radius);
    const double lengths = radius / sizes[2];
    if (lengths > kMinLengths && lengths < kMaxLengths) kinematics.half_lengths = 1e-3 * std::round(1e3 * lengths);
    return kinematics;
  }

  void add_commands(const DriverKinematics& kinematics) {
    Wheels rates = Wheels::Zero();
    WheelTable& table = record_.commands;
    for (const auto& [t, message] : commands_) {
      const auto* twist = std::get_if<geometry_msgs::Twist>(&message);
      const WheelCommand command =
          twist ? wheel_command(*twist, kinematics) : wheel_command(std::get<brics_actuator::JointVelocities>(message));
      for (int i = 0; i < kWheels; ++i) {
        if (command.set_points[i]) rates[i] = command.set_points[i]->value;
      }
      if (!table.t.empty() && (table.values.back() == rates).all()) continue;  // said again
      if (!table.t.empty() && t <= table.t.back()) {
        table.values.back() = rates;
      } else {
        table.t.push_back(t);
        table.values.push_back(rates);
      }
    }
  }

  static constexpr double kSameInstant = 1e-3;  // s: odometry's rates are those of joint_states of its stamp

  DriveRecord record_;
  /// By the time of arrival, s, in whose order bags are read.
  std::vector<std::pair<double, std::variant<geometry_msgs::Twist, brics_actuator::JointVelocities>>> commands_;
  std::vector<std::pair<double, Eigen::Vector3d>> odometry_;  // time, s; velocity, m/s and rad/s
};

}  // namespace

DriveRecord read_drive_bag(const std::string& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored))
    throw UnusableRecord(quote_path(path) + ": is no file; must be a bag");
  Reader reader(path);
  try {
    rosbag::Bag bag(path);
    const auto wanted = [](const rosbag::ConnectionInfo* info) {
      for (const char* name :
           {"joint_states", kTwistTopic, kVelocityTopic, kTorqueTopic, kOdometryTopic, kGroundTruthTopic}) {
        if (ends_with(info->topic, name)) return true;
      }
      return false;
    };
    rosbag::View view(bag, wanted);
    for (const rosbag::ConnectionInfo* info : view.getConnections()) {
      if (ends_with(info->topic, kTorqueTopic)) {
        throw UnusableRecord(quote_path(path) +
                             ": has torques_command; only drives under velocity commands can be fitted");
      }
    }
    for (const rosbag::MessageInstance& message : view) reader.add(message);
  } catch (const rosbag::BagUnindexedException&) {
    throw UnusableRecord(quote_path(path) + ": its recorder did not close it; `rosbag reindex` mends it");
  } catch (const rosbag::BagIOException& error) {
    throw UnusableRecord(fmt::format("{}: cannot be read as a bag: {}; if it was cut off, `rosbag reindex` may mend it",
                                     quote_path(path), quote(error.what(), kMaxMessage)));
  } catch (const ros::Exception& error) {
    throw UnusableRecord(
        fmt::format("{}: cannot be read as a bag: {}", quote_path(path), quote(error.what(), kMaxMessage)));
  }
  return reader.finish();
}

}  // namespace youbot_base_sim
