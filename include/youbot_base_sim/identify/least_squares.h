#pragma once

#include <Eigen/Core>

namespace youbot_base_sim {

/// The shortest x that minimizes |A x - b|. Directions that A scales by less than `threshold` times its largest pivot
/// count as scaled by zero; by default those within rounding.
///
/// Compiled once: Eigen's decompositions take seconds in each file that uses one.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, double threshold = 0);

}  // namespace youbot_base_sim
