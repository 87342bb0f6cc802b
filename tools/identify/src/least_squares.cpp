#include "youbot_base_sim/identify/least_squares.h"

#include <ceres/cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <cmath>
#include <stdexcept>

#include "youbot_base_sim/integration/motion_integrator.h"

namespace youbot_base_sim {

namespace {

class Cost : public ceres::CostFunction {
 public:
  Cost(const Residuals& residuals, Eigen::Index rows, Eigen::Index columns) : residuals_(residuals) {
    set_num_residuals(static_cast<int>(rows));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(columns));
  }

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Index columns = parameter_block_sizes()[0];
    Eigen::VectorXd values(num_residuals());
    Eigen::MatrixXd jacobian(num_residuals(), columns);
    const bool wanted = jacobians && jacobians[0];
    try {
      residuals_(Eigen::Map<const Eigen::VectorXd>(parameters[0], columns), values, wanted ? &jacobian : nullptr);
    } catch (const std::domain_error&) {
      return false;
    } catch (const Stopped&) {
      return false;
    }
    Eigen::Map<Eigen::VectorXd>(residuals, values.size()) = values;
    // Ceres has it row by row.
    if (wanted) Eigen::Map<Eigen::MatrixXd>(jacobians[0], columns, values.size()) = jacobian.transpose();
    return true;
  }

 private:
  const Residuals& residuals_;
};

}  // namespace

double robust(double residual) {
  constexpr double kOutlier = 3;
  const double s = residual * residual / (kOutlier * kOutlier);
  return std::copysign(kOutlier * std::sqrt(2 * (std::sqrt(1 + s) - 1)), residual);
}

Eigen::VectorXd minimize_squares(const Residuals& residuals, Eigen::Index rows, Eigen::VectorXd x,
                                 const Eigen::VectorXd& min, const Eigen::VectorXd& max) {
  ceres::Problem problem;
  problem.AddResidualBlock(new Cost(residuals, rows, x.size()), nullptr, x.data());
  for (int k = 0; k < x.size(); ++k) {
    problem.SetParameterLowerBound(x.data(), k, min[k]);
    problem.SetParameterUpperBound(x.data(), k, max[k]);
  }
  ceres::Solver::Options options;
  options.max_num_iterations = 8;
  options.function_tolerance = 1e-4;
  options.parameter_tolerance = 1e-4;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_line_search_step_size_iterations = 0;  // a step that fails shall be shorter, for one simulation
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return x;
}

Eigen::VectorXd solve_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  return Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(A).solve(b);
}

Eigen::MatrixXd normal_matrix(const Eigen::MatrixXd& jacobian) { return jacobian.transpose() * jacobian; }

Eigen::VectorXd step_back(const Eigen::MatrixXd& normal, Eigen::Index fixed, double change) {
  Eigen::MatrixXd others = normal;
  others.row(fixed).setZero();
  others.col(fixed).setZero();
  others(fixed, fixed) = 1;
  Eigen::VectorXd push = -normal.col(fixed) * change;
  push[fixed] = change;
  return solve_least_squares(others, push);
}

Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& normal) {
  constexpr double kNoTrace = 1e-14;  // share of the largest
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(normal);
  const Eigen::VectorXd& values = solver.eigenvalues();
  const Eigen::VectorXd inverse = values.cwiseMax(kNoTrace * values.maxCoeff()).cwiseInverse();
  return solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose();
}

}  // namespace youbot_base_sim
