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
      rocks_(robot.load_sharing != LoadSharing::kEqualWheels),
      rocking_(((robot.load_sharing == LoadSharing::kRockingFront ? 1 : -1) * kForward).max(0)),
      rho_X_(robot.rho_X()),
      rho_Y_(robot.rho_Y()) {
  const Eigen::Matrix3d& inverse = inertia.M_v_inverse;
  for (int k = 0; k < 3; ++k) {
    by_force_X_[k] = m_ * a_Z_ * (inverse(0, k) - a_Y_ * inverse(2, k));
    by_force_Y_[k] = m_ * a_Z_ * (inverse(1, k) + a_X_ * inverse(2, k));
  }
}

// Accelerations are dv = M_v^-1 (platform_forces + friction), with friction = constant + slope N.
Reactions::Conditions Reactions::conditions(const ContactByReaction& contact, const Motion& motion) const {
  const auto& [F_X, F_Y, M_Z, T_S, D] = contact;
  const ExternalForce& e = motion.external;
  const double V_X = motion.v[0], V_Y = motion.v[1], Omega = motion.v[2], m_a_Z = m_ * a_Z_;
  const Wheels constant = sums(F_X.constant, F_Y.constant, M_Z.constant) + motion.platform_forces;
  // Moment about OX of what each wheel has for no normal reaction, and of the reaction itself
  const Wheels held = D.constant + R_ * F_Y.constant + (J_1_ * Omega) * motion.dphi;
  const Wheels arm = rho_Y_ + D.slope + R_ * F_Y.slope;
  const double pitch = m_ * g_n_ * a_X_ - motion.sum_tau + e.pitch + m_a_Z * (e.g_X + Omega * (V_Y + a_X_ * Omega)) -
                       by_force_X_[0] * constant[0] - by_force_X_[1] * constant[1] - by_force_X_[2] * constant[2];
  const double roll = m_ * g_n_ * a_Y_ - held.sum() + e.roll + m_a_Z * (e.g_Y - Omega * (V_X - a_Y_ * Omega)) -
                      by_force_Y_[0] * constant[0] - by_force_Y_[1] * constant[1] - by_force_Y_[2] * constant[2];
  Conditions c;
  c.rows[0] = rho_X_ + by_force_X_[0] * F_X.slope + by_force_X_[1] * F_Y.slope + by_force_X_[2] * M_Z.slope;
  c.rows[1] = arm + by_force_Y_[0] * F_X.slope + by_force_Y_[1] * F_Y.slope + by_force_Y_[2] * M_Z.slope;
  if (rocks_) {  // moments about OX balance on the rocking axle by themselves
    c.rows[2] = rocking_ * arm;
    c.right = {pitch, roll, -(rocking_ * held).sum(), 0};
  } else {
    c.rows[2] = kForward * kLeft;
    c.right = {pitch, roll, 4 * q_, 0};
  }
  return c;
}

Reactions::Solution Reactions::solve(const ContactByReaction& contact, const Motion& motion) const {
  const double weight = m_s_ * g_n_ + motion.external.down;
  if (!(weight > 0)) return {Wheels::Zero(), {Wheels::Zero(), Wheels::Zero(), Wheels::Zero()}, Side::kOff};
  const Conditions all = conditions(contact, motion);
  const Solution solution = share(all, weight);
  return (solution.N >= 0).all() ? solution : lift(all, weight, solution.N);
}

// N = weight / 4 and three transfers of load, which leave the sum: from the rear wheels to the front ones, and on each
// axle from the right wheel to the left one.
Reactions::Solution Reactions::share(const Conditions& conditions, double weight) {
  const auto& [a, b, c] = conditions.rows;
  const auto by_transfer = [&](const Wheels& N) { return sums(a * N, b * N, c * N); };
  const PlatformMatrix transfers =
      inverse({by_transfer(kForward), by_transfer({1, -1, 0, 0}), by_transfer({0, 0, 1, -1})});
  const Wheels right = conditions.right - 0.25 * weight * sums(a, b, c);
  Solution solution;
  solution.N = Wheels::Constant(0.25 * weight);
  for (int k = 0; k < 3; ++k) {
    const Wheels& t = transfers[k];
    solution.by_moment[k] = {t[0] + t[1], t[0] - t[1], t[2] - t[0], -t[0] - t[2]};
    solution.N += right[k] * solution.by_moment[k];
  }
  return solution;
}

Reactions::Solution Reactions::lift(const Conditions& conditions, double weight, const Wheels& N) {
  // The wheel that is pulled down most is the first to be tried.
  Wheels pulled = N;
  for (int tries = 0; tries < kWheels; ++tries) {
    int i = 0;
    pulled.minCoeff(&i);
    pulled[i] = std::numeric_limits<double>::infinity();
    Conditions without = conditions;
    without.rows[2] = Wheels::Zero();
    without.rows[2][i] = 1;
    without.right[2] = 0;
    Solution lifted = share(without, weight);
    lifted.N[i] = 0;
    if (!(lifted.N >= 0).all()) continue;
    for (Wheels& by_moment : lifted.by_moment) by_moment[i] = 0;
    lifted.by_moment[2].setZero();  // its wheel stays off the floor, whatever the moment of the rocking axle
    return lifted;
  }
  return tip(conditions, weight);
}

// The two wheels of one side bear all: the moment along that side is out of balance.
Reactions::Solution Reactions::tip(const Conditions& conditions, double weight) {
  struct Candidate {
    Side side;
    int a, b, balance;  // the wheels, and the row of the moment that gives their shares
  };
  const auto& [rows, right] = conditions;
  Solution best;
  best.by_moment.fill(Wheels::Zero());
  double best_share = -std::numeric_limits<double>::infinity();
  for (const Candidate& c :
       {Candidate{Side::kLeft, 0, 2, 0}, {Side::kRight, 1, 3, 0}, {Side::kFront, 0, 1, 1}, {Side::kRear, 2, 3, 1}}) {
    const Wheels& balance = rows[c.balance];
    const double N_a = (right[c.balance] - weight * balance[c.b]) / (balance[c.a] - balance[c.b]), N_b = weight - N_a;
    // Over a corner one wheel bears all, and both sides there qualify equally.
    const double least = std::min(N_a, N_b);
    // Of opposite sides the one towards which the other moment pulls.
    const Wheels& other = rows[1 - c.balance];
    const double moment = right[1 - c.balance] - other[c.a] * N_a - other[c.b] * N_b;
    const double outwards = (c.side == Side::kLeft || c.side == Side::kFront) ? moment : -moment;
    if (outwards < 0 || least <= best_share) continue;
    best_share = least;
    best.tipping = c.side;
    best.N.setZero();
    best.N[c.a] = std::clamp(N_a, 0.0, weight);
    best.N[c.b] = weight - best.N[c.a];
  }
  if (best.tipping == Side::kNone) best.N = Wheels::Constant(weight / kWheels);
  return best;
}

void Reactions::couple(const DampingMatrix& G, const std::array<Wheels, 3>& by_moment,
                       ReactionCoupling& coupling) const {
  // Friction changes by minus G's rows: those of the platform, by wheel. `by_F` of it enters a condition.
  const auto put = [&](int m, const Wheels& by_F_X, const Wheels& by_F_Y, const Wheels& by_M_Z) {
    const auto combined = [&](const Wheels& X, const Wheels& Y, const Wheels& M) -> Wheels {
      return by_F_X * X + by_F_Y * Y + by_M_Z * M;
    };
    const auto& P = G.platform_platform;
    coupling.balance[m] = {sums(combined(P[0][0], P[1][0], P[2][0]), combined(P[0][1], P[1][1], P[2][1]),
                                combined(P[0][2], P[1][2], P[2][2])),
                           combined(G.platform_dphi[0], G.platform_dphi[1], G.platform_dphi[2]),
                           combined(G.platform_dgamma[0], G.platform_dgamma[1], G.platform_dgamma[2])};
  };
  const Wheels one = Wheels::Ones(), zero = Wheels::Zero();
  coupling.N = by_moment;
  put(0, by_force_X_[0] * one, by_force_X_[1] * one, by_force_X_[2] * one);
  coupling.balance[0].dphi += G.dphi_dphi + R_ * G.platform_dphi[0];  // the bearings' share, of sum tau
  put(1, by_force_Y_[0] * one, (by_force_Y_[1] + R_) * one, by_force_Y_[2] * one);
  if (rocks_) {
    put(2, zero, R_ * rocking_, zero);
  } else {
    coupling.balance[2] = {zero, zero, zero};
  }
}

}  // namespace youbot_base_sim
