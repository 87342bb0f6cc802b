#pragma once

#include <Eigen/Dense>
#include <functional>

namespace youbot_base_sim {

// Ceres and Eigen's decompositions, which take long to compile, for the files here. Units are the caller's.

/// Sets the residuals at x and, unless null, the Jacobian. Throws std::domain_error where there are none, and Stopped.
using Residuals = std::function<void(const Eigen::VectorXd& x, Eigen::VectorXd& residuals, Eigen::MatrixXd* jacobian)>;

/// A residual (1: as large as expected) whose square is the robust cost: quadratic at first, linear beyond 3. Ceres'
/// SoftLOneLoss applies to a block as a whole, and one block has all rows, since one simulation yields them.
double robust(double residual);

/// Returns the x within bounds, of which some may be infinite, where the sum of the squares of `rows` residuals is
/// smallest: Ceres' Levenberg-Marquardt method from `x`, for at most eight iterations. Where residuals throw Stopped it
/// ends, and the caller's next simulation throws it again.
Eigen::VectorXd minimize_squares(const Residuals& residuals, Eigen::Index rows, Eigen::VectorXd x,
                                 const Eigen::VectorXd& min, const Eigen::VectorXd& max);

/// The shortest x that minimizes |A x - b|.
Eigen::VectorXd solve_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

/// J^T J.
Eigen::MatrixXd normal_matrix(const Eigen::MatrixXd& jacobian);

/// The step that changes one unknown by `change` and adapts the others to first order; `normal` is J^T J.
Eigen::VectorXd step_back(const Eigen::MatrixXd& normal, Eigen::Index fixed, double change);

/// The inverse of J^T J: large where unknowns leave no trace in the Jacobian.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& normal);

}  // namespace youbot_base_sim
