#include "youbot_base_sim/identify/bag_reader.h"

#include <fmt/format.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <geometry_msgs/Twist.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/JointState.h>
#include <tf2/utils.h>
#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <boost/algorithm/string/predicate.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
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

/// Zeros stand for a body that is out of sight.
bool is_rotation(const geometry_msgs::Quaternion& q) {
  return std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1) <= 0.1;
}

/// Links between frames by their children. A pose in space turns into x, y and heading at the end.
class Transforms {
 public:
  /// Leaves out what tf2 would: frames without a name, rotations that are none.
  void add(const geometry_msgs::TransformStamped& link, double t, bool fixed) {
    const auto& p = link.transform.translation;
    const auto& q = link.transform.rotation;
    const std::string child = plain(link.child_frame_id), parent = plain(link.header.frame_id);
    const Eigen::Vector3d position(p.x, p.y, p.z);
    if (child.empty() || parent.empty() || !is_rotation(q) || !position.allFinite()) {
      ++left_out_;
      return;
    }
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(position).rotate(Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized());
    Link& own = links_[child];
    own.parent = parent;
    if (fixed) own.poses.clear();
    own.poses.emplace(t, pose);
  }

  /// The poses of `body` in `fixed` over time (s), along a chain of which one link moves. Throws UnusableRecord.
  std::map<double, Eigen::Isometry3d> poses(const std::string& bag, const std::string& fixed,
                                            const std::string& body) const {
    Eigen::Isometry3d before = Eigen::Isometry3d::Identity(), after = before;
    const Link* moving = nullptr;
    std::string frame = plain(body);
    for (std::size_t k = 0; frame != plain(fixed); ++k) {
      const auto link = links_.find(frame);
      if (link == links_.end() || k > links_.size())
        throw UnusableRecord(
            fmt::format("{}: no transforms from {} to {}{}", bag, quote(fixed), quote(body), left_out()));
      const bool moves = link->second.poses.size() > 1;
      if (moves && moving)
        throw UnusableRecord(
            fmt::format("{}: two links from {} to {} move; must be one", bag, quote(fixed), quote(body)));
      if (moves) moving = &link->second;
      if (!moves) (moving ? before : after) = link->second.poses.begin()->second * (moving ? before : after);
      frame = link->second.parent;
    }
    if (!moving) throw UnusableRecord(fmt::format("{}: no link from {} to {} moves", bag, quote(fixed), quote(body)));
    std::map<double, Eigen::Isometry3d> poses;
    for (const auto& [t, pose] : moving->poses) poses.emplace(t, before * pose * after);
    return poses;
  }

 private:
  struct Link {
    std::string parent;
    std::map<double, Eigen::Isometry3d> poses;
  };

  static std::string plain(const std::string& frame) {
    return frame.substr(std::min(frame.find_first_not_of('/'), frame.size()));
  }

  std::string left_out() const {
    if (left_out_ == 0) return "";
    return fmt::format(": {} are left out, which lack a frame's name, a finite position or a rotation", left_out_);
  }

  std::map<std::string, Link> links_;
  int left_out_ = 0;
};

class Reader {
 public:
  Reader(const std::string& path, const BagNames& names) : names_(names) {
    record_.name = quote_path(path);
    for (int i = 0; i < kWheels; ++i) {
      if (names_.joints[i].empty()) names_.joints[i] = wheel_joint(i);
    }
  }

  /// Chooses the topic of ground truth among all. Throws UnusableRecord where that is not clear.
  void choose_truth(const std::vector<const rosbag::ConnectionInfo*>& topics) {
    if (has_frames()) return;
    for (const char* name : {kGroundTruthTopic, "base_pose_ground_truth", "pose"}) {
      std::set<std::string> found;
      for (const rosbag::ConnectionInfo* info : topics) {
        const bool named =
            names_.truth_topic.empty() ? ends_with(info->topic, name) : info->topic == names_.truth_topic;
        if (named && is_truth_type(info->datatype)) found.insert(info->topic);
      }
      if (found.size() > 1)
        throw UnusableRecord(fmt::format("{}: ground truth on {} and {}: choose one with --truth-topic", record_.name,
                                         quote(*found.begin()), quote(*found.rbegin())));
      if (!found.empty()) truth_topic_ = *found.begin();
      if (!found.empty()) return;
    }
    if (!names_.truth_topic.empty())
      throw UnusableRecord(
          fmt::format("{}: --truth-topic {}: must be a topic of nav_msgs/Odometry, or of geometry_msgs/"
                      "PoseStamped, PoseWithCovarianceStamped or TransformStamped",
                      record_.name, quote(names_.truth_topic)));
  }

  /// Whether a topic may be needed.
  bool wants(const std::string& topic) const {
    if (topic == truth_topic_) return true;
    for (const char* name :
         {"joint_states", kTwistTopic, kVelocityTopic, kTorqueTopic, kOdometryTopic, kStateSetTopic}) {
      if (ends_with(topic, name)) return true;
    }
    return has_frames() && (ends_with(topic, "tf") || ends_with(topic, "tf_static"));
  }

  void add(const rosbag::MessageInstance& message) {
    if (ends_with(message.getTopic(), kStateSetTopic)) return note_state_set(message);
    if (message.getTopic() == truth_topic_) return add_truth(message);
    if (const auto transforms = message.instantiate<tf2_msgs::TFMessage>()) {
      for (const geometry_msgs::TransformStamped& link : transforms->transforms) {
        transforms_.add(link, time_of(link.header.stamp, message.getTime()),
                        ends_with(message.getTopic(), "tf_static"));
      }
    }
    if (const auto joints = message.instantiate<sensor_msgs::JointState>()) add(*joints, message.getTime());
    const double t = message.getTime().toSec();
    if (const auto twist = message.instantiate<geometry_msgs::Twist>()) commands_.emplace_back(t, *twist);
    if (const auto rates = message.instantiate<brics_actuator::JointVelocities>()) commands_.emplace_back(t, *rates);
    if (const auto odometry = message.instantiate<nav_msgs::Odometry>()) add_odometry(*odometry, message.getTime());
  }

  DriveRecord finish() {
    if (record_.t.empty()) throw UnusableRecord(record_.name + ": no joint_states of the four wheels");
    if (has_frames()) {
      for (const auto& [t, pose] : transforms_.poses(record_.name, names_.truth_frames[0], names_.truth_frames[1])) {
        const Eigen::Matrix3d turn = pose.linear();
        add_truth(t, pose.translation(), std::atan2(turn(1, 0), turn(0, 0)), turn(2, 2));
      }
    }
    if (!record_.truth.empty() && upright_ < kMinUpright * static_cast<double>(record_.truth.size())) {
      throw UnusableRecord(record_.name +
                           ": the z axis of ground truth is not vertical: must be, within 15 degrees; does the "
                           "tracker's y axis point up?");
    }
    record_.truth_of_marker = names_.truth_of_marker.value_or(record_.truth_of_marker);
    if (record_.rates_from_angles) differentiate_angles();
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
    const bool effort = joints.effort.size() == n, angles_alone = joints.velocity.empty();
    for (int i = 0; i < kWheels; ++i) {
      const auto found = std::find(joints.name.begin(), joints.name.end(), names_.joints[i]);
      const auto k = static_cast<std::size_t>(found - joints.name.begin());
      if (k == n || joints.position.size() != n || (!angles_alone && joints.velocity.size() != n)) return;  // an arm's
      phi[i] = names_.units[i] * joints.position[k];
      dphi[i] = angles_alone ? 0 : names_.units[i] * joints.velocity[k];
      torque[i] = effort ? std::copysign(1, names_.units[i]) * joints.effort[k] : 0;
    }
    if (record_.t.empty()) record_.rates_from_angles = angles_alone;
    if (record_.rates_from_angles != angles_alone) return;
    const double t = time_of(joints.header.stamp, arrival);
    if (!phi.isFinite().all() || !dphi.isFinite().all() || (!record_.t.empty() && t <= record_.t.back())) return;
    record_.t.push_back(t);
    record_.phi.push_back(phi);
    record_.dphi.push_back(dphi);
    record_.torque.push_back(torque.isFinite().all() ? torque : Wheels(Wheels::Zero()));
  }

  /// The base was put elsewhere: before the drive, that means nothing. Throws UnusableRecord.
  void note_state_set(const rosbag::MessageInstance& message) const {
    if (record_.t.empty()) return;
    throw UnusableRecord(
        fmt::format("{}: the base was put elsewhere at t = {:.3f} s, by {}: must be one drive; `rosbag filter` cuts it",
                    record_.name, message.getTime().toSec() - record_.t.front(), quote(message.getTopic())));
  }

  bool has_frames() const { return !names_.truth_frames[0].empty(); }

  static bool is_truth_type(const std::string& type) {
    return type == "nav_msgs/Odometry" || type == "geometry_msgs/PoseStamped" ||
           type == "geometry_msgs/PoseWithCovarianceStamped" || type == "geometry_msgs/TransformStamped";
  }

  void add_truth(const rosbag::MessageInstance& message) {
    record_.truth_of_marker = message.getDataType() != "nav_msgs/Odometry";
    if (const auto pose = message.instantiate<nav_msgs::Odometry>())
      add_truth(pose->header, pose->pose.pose.position, pose->pose.pose.orientation, message.getTime());
    if (const auto pose = message.instantiate<geometry_msgs::PoseStamped>())
      add_truth(pose->header, pose->pose.position, pose->pose.orientation, message.getTime());
    if (const auto pose = message.instantiate<geometry_msgs::PoseWithCovarianceStamped>())
      add_truth(pose->header, pose->pose.pose.position, pose->pose.pose.orientation, message.getTime());
    if (const auto pose = message.instantiate<geometry_msgs::TransformStamped>())
      add_truth(pose->header, pose->transform.translation, pose->transform.rotation, message.getTime());
  }

  template <class Position>
  void add_truth(const std_msgs::Header& header, const Position& p, const geometry_msgs::Quaternion& q,
                 const ros::Time& arrival) {
    if (!is_rotation(q)) return;
    add_truth(time_of(header.stamp, arrival), {p.x, p.y, p.z}, tf2::getYaw(q), 1 - 2 * (q.x * q.x + q.y * q.y));
  }

  void add_truth(double t, const Eigen::Vector3d& position, double heading, double upright) {
    if (!position.allFinite() || (!record_.truth_t.empty() && t <= record_.truth_t.back())) return;
    if (!record_.truth.empty())
      heading = record_.truth.back()[2] + std::remainder(heading - record_.truth.back()[2], 2 * M_PI);
    record_.truth_t.push_back(t);
    record_.truth.emplace_back(position[0], position[1], heading);
    upright_ += upright;
  }

  void differentiate_angles() {
    const std::size_t last = record_.t.size() - 1;
    for (std::size_t k = 0; k <= last && last > 0; ++k) {
      const std::size_t a = k > 0 ? k - 1 : 0, b = std::min(k + 1, last);
      record_.dphi[k] = (record_.phi[b] - record_.phi[a]) / (record_.t[b] - record_.t[a]);
    }
  }

  void add_odometry(const nav_msgs::Odometry& message, const ros::Time& arrival) {
    const auto& v = message.twist.twist;
    const Eigen::Vector3d velocity(v.linear.x, v.linear.y, v.angular.z);
    if (velocity.allFinite()) odometry_.emplace_back(time_of(message.header.stamp, arrival), velocity);
  }

  /// The lengths with which odometry makes its velocities from the wheels' rates. Those are linear, and their
  /// coefficients follow from least squares, whatever signs the rates have: R / 4 forward and lateral, R / (4 h) in
  /// yaw.
  DriverKinematics kinematics_of_odometry() {
    constexpr double kMinShare = 1e-3;         // of the rates' squares; directions below it are noise
    constexpr double kMinIndependence = 0.01;  // 1: the three velocities are not correlated
    constexpr double kMinRadius = 0.01, kMaxRadius = 0.2, kMinLengths = 0.05, kMaxLengths = 2;  // m
    Eigen::Matrix4d squares = Eigen::Matrix4d::Zero();
    Eigen::Matrix<double, kWheels, 3> moments = Eigen::Matrix<double, kWheels, 3>::Zero();
    Eigen::Matrix3d directions = Eigen::Matrix3d::Zero();
    for (const auto& [t, velocity] : odometry_) {
      const auto joints = std::lower_bound(record_.t.begin(), record_.t.end(), t - kSameInstant);
      if (joints == record_.t.end() || *joints > t + kSameInstant) continue;
      const Wheels& rates = record_.dphi[static_cast<std::size_t>(joints - record_.t.begin())];
      squares += rates.matrix() * rates.matrix().transpose();
      moments += rates.matrix() * velocity.transpose();
      directions += velocity * velocity.transpose();
    }
    // R, R, R / h; 0 of a motion that was never made
    Eigen::Vector3d sizes;
    for (int m = 0; m < 3; ++m) sizes[m] = 2 * solve_least_squares(squares, moments.col(m), kMinShare).norm();
    DriverKinematics kinematics;
    const double radius = std::max(sizes[0], sizes[1]);
    if (radius > kMinRadius && radius < kMaxRadius) kinematics.wheel_radius = 1e-4 * std::round(1e4 * radius);
    const double lengths = radius / sizes[2];
    if (lengths > kMinLengths && lengths < kMaxLengths) kinematics.half_lengths = 1e-3 * std::round(1e3 * lengths);
    // They are the odometry's own only if it moved in three independent directions.
    if (directions.determinant() > kMinIndependence * directions.diagonal().prod()) {
      record_.odometry_radius = radius;
      record_.odometry_lengths = lengths;
    }
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

  static constexpr double kMinUpright = 0.966;  // cosine of 15 degrees
  static constexpr double kSameInstant = 1e-3;  // s: odometry's rates are those of joint_states of its stamp

  BagNames names_;
  std::string truth_topic_;  // empty: none
  DriveRecord record_;
  double upright_ = 0;  // sum of the vertical parts of ground truth's z axes
  Transforms transforms_;
  /// By the time of arrival, s, in whose order bags are read.
  std::vector<std::pair<double, std::variant<geometry_msgs::Twist, brics_actuator::JointVelocities>>> commands_;
  std::vector<std::pair<double, Eigen::Vector3d>> odometry_;  // time, s; velocity, m/s and rad/s
};

}  // namespace

DriveRecord read_drive_bag(const std::string& path, const BagNames& names) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored))
    throw UnusableRecord(quote_path(path) + ": is no file; must be a bag");
  Reader reader(path, names);
  try {
    rosbag::Bag bag(path);
    reader.choose_truth(rosbag::View(bag).getConnections());
    rosbag::View view(bag, [&](const rosbag::ConnectionInfo* info) { return reader.wants(info->topic); });
    for (const rosbag::ConnectionInfo* info : view.getConnections()) {
      if (!names.angles_alone && ends_with(info->topic, kTorqueTopic)) {
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
