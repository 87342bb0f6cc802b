#pragma once

#include <Eigen/Core>

namespace youbot_base_sim {

// Linear algebra that is compiled once: Eigen's decompositions and products take seconds in each file that uses them.

/// The shortest x that minimizes |A x - b|. Directions that A scales by less than `threshold` times its largest pivot
/// count as scaled by zero; by default those within rounding.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, double threshold = 0);

/// A^T A.
Eigen::MatrixXd products_of_columns(const Eigen::MatrixXd& A);

}  // namespace youbot_base_sim
