#pragma once

namespace youbot_base_sim {

/// Radau IIA with three stages, of order 5 and stage order 3: E. Hairer and G. Wanner, Solving Ordinary Differential
/// Equations II, 2nd ed., sections IV.5 and IV.8.
struct RadauTableau {
  static constexpr int stages = 3;
  static constexpr double root_6 = 2.449489742783178098;
  /// Nodes; the last one is the step's end.
  static constexpr double c[3] = {(4 - root_6) / 10, (4 + root_6) / 10, 1};
  static constexpr double A[3][3] = {{(88 - 7 * root_6) / 360, (296 - 169 * root_6) / 1800, (-2 + 3 * root_6) / 225},
                                     {(296 + 169 * root_6) / 1800, (88 + 7 * root_6) / 360, (-2 - 3 * root_6) / 225},
                                     {(16 - root_6) / 36, (16 + root_6) / 36, 1.0 / 9}};
  static constexpr double A_inverse[3][3] = {{(4 + root_6) / 2, (-36 + 29 * root_6) / 30, (6 - 4 * root_6) / 15},
                                             {(-36 - 29 * root_6) / 30, (4 - root_6) / 2, (6 + 4 * root_6) / 15},
                                             {(-3 + 8 * root_6) / 3, (-3 - 8 * root_6) / 3, 5}};
  /// Real eigenvalue of A^-1.
  static constexpr double gamma = 3.6378342527444957322;
  /// Weights of the stages in the error estimate, (8.19) of section IV.8, which is of order 3.
  static constexpr double error[3] = {-(13 + 7 * root_6) / 3, (-13 + 7 * root_6) / 3, -1.0 / 3};
  /// Weight of stage j in this estimate for an integral of what the stages have, whose start has the weight 1.
  static constexpr double error_of_integral(int j) {
    return error[0] * A[0][j] + error[1] * A[1][j] + error[2] * A[2][j];
  }
};

}  // namespace youbot_base_sim
