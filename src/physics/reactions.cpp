#include "youbot_base_sim/physics/reactions.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace youbot_base_sim {

namespace {

const Wheels kForward{1, 1, -1, -1}, kLeft{1, -1, 1, -1};

}  // namespace

const char* name_of(Side side) {
  switch (side) {
    case Side::kLeft:
      return "left";
    case Side::kRight:
      return "right";
    case Side::kFront:
      return "front";
    case Side::kRear:
      return "rear";
    case Side::kOff:
    case Side::kNone:
      break;
  }
  return "";
}

TippedOver::TippedOver(double t, Side side)
    : std::domain_error(side == Side::kOff
                            ? fmt::format("the base is lifted off the floor at t = {:.9g} s", t)
                            : fmt::format("the base tips over at t = {:.9g} s: the wheels of the {} side bear all", t,
                                          name_of(side))),
      time_(t),
      side_(side) {}

Reactions::Reactions(const RobotParameters& robot, const Inertia& inertia, double normal_gravity)
    : m_(robot.m),
      m_s_(robot.m_s()),
      a_X_(robot.a_X),
      a_Y_(robot.a_Y),
      a_Z_(robot.a_Z),
      J_1_(robot.J_1),
      R_(robot.R),
      q_(robot.q),
      g_n_(normal_gravity),
      sharing_(robot.load_sharing),
      rho_X_(robot.rho_X()),
      rho_Y_(robot.rho_Y()) {
  const Eigen::Matrix3d& inverse = inertia.M_v_inverse;
  for (int k = 0; k < 3; ++k) {
    by_force_X_[k] = m_ * a_Z_ * (inverse(0, k) - a_Y_ * inverse(2, k));
    by_force_Y_[k] = m_ * a_Z_ * (inverse(1, k) + a_X_ * inverse(2, k));
  }
}

// Accelerations are dv = M_v^-1 (platform_forces + friction), with friction = constant + slope N.
Reactions::Balance Reactions::balance(const ContactByReaction& contact, const Motion& motion) const {
  const auto& [F_X, F_Y, M_Z, D] = contact;
  const ExternalForce& e = motion.external;
  const double V_X = motion.v[0], V_Y = motion.v[1], Omega = motion.v[2], m_a_Z = m_ * a_Z_;
  Wheels constant = sums(F_X.constant, F_Y.constant, M_Z.constant) + motion.platform_forces;
  Balance b;
  b.pitch = rho_X_ + by_force_X_[0] * F_X.slope + by_force_X_[1] * F_Y.slope + by_force_X_[2] * M_Z.slope;
  b.pitch_right = m_ * g_n_ * a_X_ - motion.sum_tau + e.pitch + m_a_Z * (e.g_X + Omega * (V_Y + a_X_ * Omega)) -
                  by_force_X_[0] * constant[0] - by_force_X_[1] * constant[1] - by_force_X_[2] * constant[2];
  b.roll = rho_Y_ + D.slope + R_ * F_Y.slope + by_force_Y_[0] * F_X.slope + by_force_Y_[1] * F_Y.slope +
           by_force_Y_[2] * M_Z.slope;
  b.roll_right = m_ * g_n_ * a_Y_ - (R_ * F_Y.constant + D.constant + J_1_ * Omega * motion.dphi).sum() + e.roll +
                 m_a_Z * (e.g_Y - Omega * (V_X - a_Y_ * Omega)) - by_force_Y_[0] * constant[0] -
                 by_force_Y_[1] * constant[1] - by_force_Y_[2] * constant[2];
  return b;
}

// N = c_0 + c_X s_X + c_Y s_Y + q s_X s_Y: two equations remain.
Wheels Reactions::equal_wheels(const Balance& b, double weight) const {
  const Wheels known = 0.25 * weight + q_ * (kForward * kLeft);
  const double a = (b.pitch * kForward).sum(), c = (b.pitch * kLeft).sum(), d = (b.roll * kForward).sum(),
               e = (b.roll * kLeft).sum();
  const double x = b.pitch_right - (b.pitch * known).sum(), y = b.roll_right - (b.roll * known).sum();
  const double per_determinant = 1 / (a * e - c * d);
  return known + (x * e - y * c) * per_determinant * kForward + (y * a - x * d) * per_determinant * kLeft;
}

// The row and right-hand side of the condition that says how four wheels share.
Wheels Reactions::fourth_condition(const ContactByReaction& contact, const Motion& motion, double& right) const {
  if (sharing_ == LoadSharing::kEqualWheels) {
    right = 4 * q_;
    return kForward * kLeft;
  }
  // Moments about OX balance on the rocking axle by themselves.
  const Wheels axle = ((sharing_ == LoadSharing::kRockingFront ? 1 : -1) * kForward).max(0);
  const double Omega = motion.v[2];
  right = -(axle * (contact.D.constant + R_ * contact.F_Y.constant + J_1_ * Omega * motion.dphi)).sum();
  return axle * (rho_Y_ + contact.D.slope + R_ * contact.F_Y.slope);
}

Reactions::Solution Reactions::solve(const ContactByReaction& contact, const Motion& motion) const {
  const double weight = m_s_ * g_n_ + motion.external.down;
  if (!(weight > 0)) return {Wheels::Zero(), Side::kOff};
  const Balance b = balance(contact, motion);
  Wheels N;
  if (sharing_ == LoadSharing::kEqualWheels) {
    N = equal_wheels(b, weight);
    if ((N >= 0).all()) return {N, Side::kNone};
  }
  Matrix rows;
  Vector right{weight, b.pitch_right, b.roll_right, 0};
  rows << Eigen::RowVector4d::Ones(), b.pitch.matrix().transpose(), b.roll.matrix().transpose(),
      fourth_condition(contact, motion, right[3]).matrix().transpose();
  if (sharing_ != LoadSharing::kEqualWheels) {
    N = rows.partialPivLu().solve(right).array();
    if ((N >= 0).all()) return {N, Side::kNone};
  }
  return lift(rows, right, N);
}

Reactions::Solution Reactions::lift(Matrix rows, Vector right, const Wheels& N) const {
  const Matrix all_rows = rows;
  const Vector all_right = right;
  // The wheel that is pulled down most is the first to be tried.
  Wheels pulled = N;
  for (int tries = 0; tries < kWheels; ++tries) {
    int i = 0;
    pulled.minCoeff(&i);
    pulled[i] = std::numeric_limits<double>::infinity();
    rows.row(3).setZero();
    rows(3, i) = 1;
    right[3] = 0;
    Wheels lifted = rows.partialPivLu().solve(right).array();
    lifted[i] = 0;
    if ((lifted >= 0).all()) return {lifted, Side::kNone};
  }
  return tip(all_rows, all_right);
}

// The two wheels of one side bear all: the moment along that side is out of balance.
Reactions::Solution Reactions::tip(const Matrix& rows, const Vector& right) const {
  struct Candidate {
    Side side;
    int a, b, balance;  // the wheels, and the row of the moment that gives their shares
  };
  Solution best;
  double best_share = -std::numeric_limits<double>::infinity();
  for (const Candidate& c :
       {Candidate{Side::kLeft, 0, 2, 1}, {Side::kRight, 1, 3, 1}, {Side::kFront, 0, 1, 2}, {Side::kRear, 2, 3, 2}}) {
    Eigen::Matrix2d shares;
    shares << 1, 1, rows(c.balance, c.a), rows(c.balance, c.b);
    const Eigen::Vector2d N = shares.partialPivLu().solve(Eigen::Vector2d{right[0], right[c.balance]});
    // Over a corner one wheel bears all, and both sides there qualify equally.
    const double least = N.minCoeff();
    // Of opposite sides the one towards which the other moment pulls.
    const int other = 3 - c.balance;
    const double moment = right[other] - rows(other, c.a) * N[0] - rows(other, c.b) * N[1];
    const double outwards = (c.side == Side::kLeft || c.side == Side::kFront) ? moment : -moment;
    if (outwards < 0 || least <= best_share) continue;
    best_share = least;
    best.tipping = c.side;
    best.N.setZero();
    best.N[c.a] = std::clamp(N[0], 0.0, right[0]);
    best.N[c.b] = right[0] - best.N[c.a];
  }
  if (best.tipping == Side::kNone) best.N = Wheels::Constant(right[0] / kWheels);
  return best;
}

}  // namespace youbot_base_sim
