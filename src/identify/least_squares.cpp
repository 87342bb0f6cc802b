#include "youbot_base_sim/identify/least_squares.h"

#include <Eigen/QR>

namespace youbot_base_sim {

Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, double threshold) {
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
  if (threshold > 0) decomposition.setThreshold(threshold);
  return decomposition.compute(A).solve(b);
}

Eigen::MatrixXd products_of_columns(const Eigen::MatrixXd& A) { return A.transpose() * A; }

}  // namespace youbot_base_sim
