#pragma once

#include <cstdint>

/// Names, queue sizes and rates of the ROS interface. Names without a leading slash are relative to the node's
/// namespace, as those of the driver.
namespace youbot_base_sim {

constexpr char kOdometryFrame[] = "odom";        ///< as the driver's
constexpr char kBaseFrame[] = "base_footprint";  ///< as the driver's; over O, the geometric centre of the base
constexpr char kWorldFrame[] = "world";          ///< the fixed frame of the scene
constexpr char kTruthFrame[] = "ground_truth/base_footprint";  ///< where the base is; kBaseFrame: by odometry
constexpr char kTruthPrefix[] = "ground_truth/";
constexpr char kBaseLinkFrame[] = "base_link";  ///< as the driver's
constexpr char kImuFrame[] = "imu_link";        ///< of an inertial unit that is not in the middle
constexpr char kWheelFramePrefix[] = "wheel_link_";

constexpr char kWheelJointPrefix[] = "wheel_joint_";
constexpr char kCasterJointPrefix[] = "caster_joint_";
constexpr char kRollerJointPrefix[] = "roller_joint_";

// Commands. The driver has no topics for single wheels; these are named by analogy to the arm's.
constexpr char kTwistTopic[] = "cmd_vel";
constexpr char kTorqueTopic[] = "base/base_controller/torques_command";
constexpr char kWrenchTopic[] = "wrench";            // private
constexpr char kInitialPoseTopic[] = "initialpose";  // as amcl's: rviz's "2D Pose Estimate"
constexpr char kVelocityTopic[] = "base/base_controller/velocity_command";

// Telemetry.
constexpr char kOdometryTopic[] = "odom";
constexpr char kGroundTruthTopic[] = "ground_truth";
constexpr char kImuTopic[] = "imu/data";
constexpr char kJointStatesTopic[] = "base/joint_states";
constexpr char kTransformsTopic[] = "/tf";
constexpr char kStaticTransformsTopic[] = "/tf_static";
constexpr char kRollerSwitchesTopic[] = "base/roller_switches";
constexpr char kContactsTopic[] = "contacts";
constexpr char kLoadsTopic[] = "loads";
constexpr char kAppliedWrenchTopic[] = "applied_wrench";
constexpr char kStateSetTopic[] = "state_set";
constexpr char kContactMarkersTopic[] = "contact_markers";
constexpr char kSceneTopic[] = "scene";
constexpr char kDiagnosticsTopic[] = "/diagnostics";
constexpr char kDashboardTopic[] = "/dashboard/platform_state";
constexpr char kClockTopic[] = "/clock";

// Services of the driver.
constexpr char kSwitchOffService[] = "base/switchOffMotors";
constexpr char kSwitchOnService[] = "base/switchOnMotors";
constexpr char kReconnectService[] = "reconnect";

// Services of the simulator, in the node's private namespace.
constexpr char kSetFaultsService[] = "set_faults";
constexpr char kSetLoadsService[] = "set_loads";
constexpr char kSetStateService[] = "set_state";
constexpr char kPauseService[] = "pause";
constexpr char kUnpauseService[] = "unpause";
constexpr char kResetService[] = "reset";
constexpr char kStepService[] = "step";
constexpr char kEndService[] = "end";

constexpr std::uint32_t kCommandQueueSize = 1000;   ///< of subscribers, as the driver's
constexpr std::uint32_t kDriverQueueSize = 1;       ///< of publishers, as the driver's: the latest message counts
constexpr std::uint32_t kRecorderQueueSize = 1000;  ///< of publishers whose every message counts

constexpr double kDiagnosticsRate = 0.5;  ///< Hz, as the driver's
constexpr double kBagMarkersRate = 25;    ///< Hz: as smooth as a film, in bags of any rate

}  // namespace youbot_base_sim
