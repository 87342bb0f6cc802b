// Covariances of odometry, where they are asked for, cover what the odometry is off.

#include <Eigen/Dense>

#include "base_client.h"

namespace youbot_base_sim {
namespace {

Eigen::Matrix3d covariance_of(const boost::array<double, 36>& message) {
  constexpr int kAt[] = {0, 1, 5};
  Eigen::Matrix3d covariance;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) covariance(i, j) = message[6 * kAt[i] + kAt[j]];
  }
  return covariance;
}

TEST(OdometryCovariance, covers_the_error) {
  BaseClient& base = BaseClient::fresh();
  for (const auto& command : {twist(0.4, 0, 0), twist(0, 0.3, 0), twist(0.2, 0.1, 0.8)}) {
    base.command(command);
    base.idle(999);
    base.settle();
    const auto& truth = base.truth.pose.pose;
    const auto& odometry = base.odometry.pose.pose;
    const Eigen::Vector3d error(odometry.position.x - truth.position.x, odometry.position.y - truth.position.y,
                                std::remainder(heading(odometry.orientation) - heading(truth.orientation), 2 * M_PI));
    const Eigen::Matrix3d covariance = covariance_of(base.odometry.pose.covariance);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues().minCoeff(), 0);
    // Mahalanobis distance: within four deviations, and not a hundredth of one.
    const double distance = std::sqrt(error.dot(covariance.inverse() * error));
    EXPECT_LT(distance, 4) << error.transpose() << "\n" << covariance;
    EXPECT_GT(distance, 0.01);
    EXPECT_GT(base.odometry.twist.covariance[0], 0);
  }
  EXPECT_EQ(base.truth.pose.covariance[0], 0) << "ground truth is exact";
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
