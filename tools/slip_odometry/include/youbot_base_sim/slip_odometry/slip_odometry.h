#pragma once

#include <Eigen/Dense>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "youbot_base_sim/drive/driver_kinematics.h"
#include "youbot_base_sim/export.h"
#include "youbot_base_sim/sensors/wheel_odometry.h"
#include "youbot_base_sim/simulation.h"
#include "youbot_base_sim/slip_odometry/phase_search.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Odometry that knows rollers and slip: prescribes the wheel angles that encoders read to simulations of the base, and
/// reads off where they go. Each reading takes bounded work, whatever it says.
///
/// Encoders count from where the wheels stood when they were switched on, so which rollers touch the floor is unknown
/// unless `angles_at_zero` says it. Then several replicas of the base, their rollers spread evenly, are simulated: the
/// base moves by their mean, and their spread tells how far that may be off. Where the torques of the drives are known,
/// they show within a minute or two of driving in all directions which rollers do: from then on one is simulated.
class SlipOdometry {
 public:
  struct Settings {
    std::optional<double> wheel_error;     ///< relative, of a wheel's path: WheelOdometry's; identify finds it
    double max_gap = 0.5;                  ///< s: over a longer one the wheels are taken to turn within so long
    double max_rate = 30;                  ///< rad/s: an encoder that is faster has jumped
    double max_effort_error = 1;           ///< N m, of means over a second; infinite: efforts do not count
    std::optional<Wheels> angles_at_zero;  ///< the angles of the wheels where their encoders read zero, rad
    int replicas = 4;                      ///< where these are unknown
  };

  /// `scene`: drive and initial state do not matter. Throws std::invalid_argument for a model without slip.
  SlipOdometry(const Scene& scene, const Settings& settings);
  ~SlipOdometry();

  /// Takes the readings `phi` of the encoders (rad, positive forward) at time t (s), and torques (N m, of either sign)
  /// and rates (in any unit) if known. An earlier t begins anew from the present pose; one within a millisecond waits.
  void update(double t, const Wheels& phi, const std::optional<Wheels>& torque = std::nullopt,
              const std::optional<Wheels>& dphi = std::nullopt);

  /// Sets the pose back to zero; the wheels go on.
  void reset();

  /// x, y (m) and heading (rad, unwrapped) in the frame of the first pose.
  Eigen::Vector3d pose() const;
  /// V_X, V_Y (m/s) and Omega (rad/s).
  Eigen::Vector3d velocity() const;

  /// Covariances of both, in the frames of both. They grow faster while there is a doubt.
  Eigen::Matrix3d pose_covariance() const;
  Eigen::Matrix3d velocity_covariance() const;

  /// For each wheel 1 where efforts drive the motion, -1 where they are reversed, 0 where unknown and without effect.
  const Wheels& effort_signs() const { return effort_sign_; }

  /// How many times the changes of its angles each wheel's rates are; 0: unknown, they do not fit, or differ by more
  /// than 5 % from the other wheels', so that they are not used.
  Wheels rate_factors() const;

  /// The rollers that touch the floor, as far as torques have shown them; empty where that is known or there are none.
  const std::optional<PhaseSearch>& search() const { return search_; }

  /// The reason why the last reading does not tell where the base is, in one line; empty if it does.
  const std::string& doubt() const { return doubt_; }

 private:
  class Replica;
  struct Reading {
    double t;    ///< s
    Wheels phi;  ///< rad
  };

  /// Between two readings.
  struct Interval {
    Wheels moved;                  ///< rad
    Wheels rate;                   ///< mean, rad/s
    double length;                 ///< s
    std::optional<Wheels> torque;  ///< at its end, N m
    std::optional<Wheels> dphi;    ///< there, as read
  };

  void begin(double t, const Wheels& phi);
  void check_time(const Wheels& moved);
  Wheels checked(const Wheels& moved, double dt);
  Interval interval_of(const Wheels& moved, double dt);
  Wheels end_rate_before(const Interval& next);
  void simulate(const Interval& interval, const Wheels& end_rate);
  Eigen::Vector3d mean_displacement(const Interval& interval, const Wheels& end_rate);
  Eigen::Vector3d latest_displacement() const;
  void check_wheels();
  void learn_effort_signs(const Wheels& torque, const Wheels& expected, double dt);
  void make_replicas(bool known, bool efforts);
  void set_phases();
  void take_torque(const Wheels& torque, const Interval& interval);
  void check_torque(const Wheels& torque, const Wheels& expected, const Interval& interval);
  void doubt(const std::string& reason, double speed, double dt);
  double fastest(const Wheels& rate) const;  // speed of the rims, m/s
  Eigen::Matrix3Xd values(Eigen::Vector3d (Replica::*value)() const, bool all) const;
  Eigen::Matrix3d of_speeds(double variance) const;

  Scene scene_;
  Settings settings_;
  DriverKinematics kinematics_;
  std::optional<PhaseSearch> search_;  // where phases are unknown and there are efforts
  std::vector<std::unique_ptr<Replica>> replicas_;
  int simulated_ = 0;          // the first of them; the others move with them, as far off as they are
  WheelOdometry uncertainty_;  // of the same wheels: only its covariances count
  std::optional<Reading> last_;
  std::optional<Interval> latest_;                  // before it; the next reading shows how it ended
  Eigen::Vector3d pose_ = Eigen::Vector3d::Zero();  // where it begins
  Wheels followed_ = Wheels::Zero();                // readings there, rad
  Interval before_;                                 // and the one before that
  Eigen::Vector3d slip_ = Eigen::Vector3d::Zero();  // velocity less that of kinematics before it, m/s, m/s, rad/s
  Wheels rate_product_ = Wheels::Zero();            // of rates read with those of angles, rad^2/s
  Wheels rate_square_ = Wheels::Zero();             // of the latter
  Wheels dphi_square_ = Wheels::Zero();             // of the former, in their unit
  Wheels effort_sign_ = Wheels::Zero();
  /// The time in which signs of efforts agreed with those of expected torques, less that in which they did not, s.
  Wheels effort_agreement_ = Wheels::Zero();
  Wheels effort_time_ = Wheels::Zero();   // in which expected torques were large, s
  Wheels effort_error_ = Wheels::Zero();  // mean over about a second, N m
  double doubtful_variance_ = 0;          // of the position, m^2
  double doubtful_way_ = 0;               // how far it lies the way that the present doubtful speed goes, m
  double doubtful_speed_ = 0;             // m/s
  std::string doubt_;
};

}  // namespace youbot_base_sim
