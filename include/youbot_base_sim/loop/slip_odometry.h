#pragma once

#include <Eigen/Dense>
#include <memory>
#include <optional>
#include <string>

#include "youbot_base_sim/drive/wheel_odometry.h"
#include "youbot_base_sim/export.h"
#include "youbot_base_sim/simulation.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Odometry that knows rollers and slip: prescribes the wheel angles that encoders read to a simulation of the base,
/// and reads off where it goes. Each reading takes bounded work, whatever it says.
class SlipOdometry {
 public:
  struct Settings {
    double wheel_error = 0.015;     ///< relative, of a wheel's path: see WheelOdometry
    double max_gap = 0.5;           ///< s: over a longer one the wheels are taken to turn within so long
    double max_rate = 30;           ///< rad/s: an encoder that is faster has jumped
    double max_effort_error = 1;    ///< N m, of means over a second; infinite: efforts do not count
    bool averaged_contacts = true;  ///< for encoders that do not know which roller touches the floor
  };

  /// `scene` has robot, floor and solver; its drive and initial state do not matter.
  SlipOdometry(const Scene& scene, const Settings& settings);

  /// Takes the wheel angles `phi` (rad, positive forward) at time t (s), and the torques of the drives (N m) if they
  /// are known. A reading of an earlier time begins anew from the present pose.
  void update(double t, const Wheels& phi, const std::optional<Wheels>& torque = std::nullopt);

  /// Sets the pose back to zero; the wheels go on.
  void reset();

  /// x, y (m) and heading (rad, unwrapped) in the frame of the first pose.
  Eigen::Vector3d pose() const;
  /// V_X, V_Y (m/s) and Omega (rad/s).
  Eigen::Vector3d velocity() const;

  /// Covariances of both, in the frames of both. They grow faster while there is a doubt.
  Eigen::Matrix3d pose_covariance() const;
  Eigen::Matrix3d velocity_covariance() const;

  /// Why the last reading does not tell where the base is, in one line; empty if it does.
  const std::string& doubt() const { return doubt_; }

 private:
  class Segment;
  struct Reading {
    double t;    ///< s
    Wheels phi;  ///< rad
  };

  void begin();
  void leave();
  Wheels checked(const Wheels& moved, double dt);
  void advance(const Wheels& moved, double dt);
  void check_wheels(double dt);
  void check_torque(const Wheels& torque, double dt);
  void doubt(const std::string& reason, double speed, double dt);

  Scene scene_;
  Settings settings_;
  std::shared_ptr<Segment> segment_;
  std::unique_ptr<Simulation> simulation_;            // null before it begins, with the second reading
  WheelOdometry uncertainty_;                         // of the same wheels: only its covariances count
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();  // where the simulation began
  std::optional<Reading> last_;
  Wheels rate_ = Wheels::Zero();          // mean of the last interval, rad/s
  Wheels followed_ = Wheels::Zero();      // rad, since the first reading
  Wheels effort_error_ = Wheels::Zero();  // mean over about a second, N m
  double doubtful_variance_ = 0;          // of the position, m^2
  double doubtful_speed_ = 0;             // m/s
  std::string doubt_;
};

}  // namespace youbot_base_sim
