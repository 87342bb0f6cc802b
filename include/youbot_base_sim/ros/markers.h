#pragma once

#include <visualization_msgs/MarkerArray.h>

#include <Eigen/Geometry>
#include <string>

namespace youbot_base_sim {

/// Arrows end at this length, m: those of a wheel that spins freely would leave the picture.
constexpr double kMaxArrow = 0.4;

constexpr double kLetter = 0.035;  ///< height of text, m

std_msgs::ColorRGBA colour(double r, double g, double b, double a = 1);

/// How far an arrow of a vector goes, with `scale` m for each of its unit.
Eigen::Vector3d way_of(const Eigen::Vector3d& vector, double scale);

geometry_msgs::Pose pose_message(const Eigen::Isometry3d& pose);

/// A marker array under way. All markers are in the frame of `header`, with which they move, unless changed.
class Markers {
 public:
  explicit Markers(const std_msgs::Header& header) : header_(header) {}

  visualization_msgs::Marker& add(const std::string& ns, int id, int type, const std_msgs::ColorRGBA& colour);

  /// What an id showed before is no longer there.
  void remove(const std::string& ns, int id);

  /// An arrow from `start` along `vector`, in its unit, of `scale` m for each; none where it could not be seen.
  void add_arrow(const std::string& ns, int id, const Eigen::Vector3d& start, const Eigen::Vector3d& vector,
                 double scale, const std_msgs::ColorRGBA& colour);

  /// The same, twice as thick, and it ends at `end`.
  void add_arrow_to(const std::string& ns, int id, const Eigen::Vector3d& end, const Eigen::Vector3d& vector,
                    double scale, const std_msgs::ColorRGBA& colour);

  visualization_msgs::Marker& add_text(const std::string& ns, int id, const Eigen::Vector3d& position,
                                       const std::string& text, const std_msgs::ColorRGBA& colour);

  visualization_msgs::MarkerArray array;

 private:
  void add_way(const std::string& ns, int id, const Eigen::Vector3d& start, const Eigen::Vector3d& way, double width,
               const std_msgs::ColorRGBA& colour);

  std_msgs::Header header_;
};

}  // namespace youbot_base_sim
