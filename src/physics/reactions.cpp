#include "youbot_base_sim/physics/reactions.h"

#include <fmt/format.h>

#include <algorithm>

namespace youbot_base_sim {

const char* name_of(Side side) {
  // The order is that of Side.
  constexpr std::array<const char*, 6> kNames = {"", "left", "right", "front", "rear", ""};
  return kNames[static_cast<std::size_t>(side)];
}

TippedOver::TippedOver(double t, Side side)
    : std::domain_error(side == Side::kOff
                            ? fmt::format("the base is lifted off the floor at t = {:.9g} s", t)
                            : fmt::format("the base tips over at t = {:.9g} s: the wheels of the {} side carry all", t,
                                          name_of(side))),
      time_(t),
      side_(side) {}

Reactions::Reactions(const RobotParameters& robot, const Inertia& inertia, double normal_gravity, double friction_arm)
    : m_(robot.m),
      m_s_(robot.m_s()),
      a_X_(robot.a_X),
      a_Y_(robot.a_Y),
      a_Z_(robot.a_Z),
      J_1_(robot.J_1),
      R_(robot.R),
      friction_arm_(friction_arm),
      q_(robot.q),
      g_n_(normal_gravity),
      rocks_(robot.load_sharing != LoadSharing::kEqualWheels),
      rocking_(robot.load_sharing == LoadSharing::kRockingFront ? Wheels{1, 1, 0, 0} : Wheels{0, 0, 1, 1}),
      rho_X_(robot.rho_X()),
      rho_Y_(robot.rho_Y()) {
  const Eigen::Matrix3d& inverse = inertia.M_v_inverse;
  for (int k = 0; k < 3; ++k) {
    by_force_X_[k] = m_ * a_Z_ * (inverse(0, k) - a_Y_ * inverse(2, k));
    by_force_Y_[k] = m_ * a_Z_ * (inverse(1, k) + a_X_ * inverse(2, k));
  }
  // Drives of prescribed wheels also exert the reaction of friction on the body.
  pitch_by_F_X_ = by_force_X_[0] + (robot.R - friction_arm);
}

Reactions::Solution Reactions::lift(const Conditions& conditions, double weight, const Wheels& N) const {
  if (!(weight > 0)) return {Wheels::Zero(), {Wheels::Zero(), Wheels::Zero(), Wheels::Zero()}, Side::kOff};
  if (rocks_) return tip_on_three_points(conditions, weight, N);
  // The wheel that is pulled down most is the first to be tried.
  Wheels pulled = N;
  for (int tries = 0; tries < kWheels; ++tries) {
    int i = 0;
    pulled.minCoeff(&i);
    pulled[i] = kInfinity;
    const Solution lifted = share_without(i, 2, conditions, weight);
    if ((lifted.N >= 0).all()) return lifted;
  }
  return tip(conditions, weight);
}

Reactions::Solution Reactions::share_without(int i, std::size_t replaced, Conditions conditions, double weight) {
  conditions.rows[replaced] = Wheels::Zero();
  conditions.rows[replaced][i] = 1;
  conditions.right[static_cast<int>(replaced)] = 0;
  Solution lifted = share(conditions, weight);
  lifted.N[i] = 0;
  for (Wheels& by_moment : lifted.by_moment) by_moment[i] = 0;
  lifted.by_moment[replaced].setZero();  // there is no moment in the condition that its wheel has replaced
  return lifted;
}

// One wheel of the axle that does not rock lifts: the other one and the rocking axle, whose moment still balances,
// carry all. If the rocking axle is the one that lifts, or one of its wheels, two wheels of one side do.
Reactions::Solution Reactions::tip_on_three_points(const Conditions& conditions, double weight, const Wheels& N) const {
  int i = 0;
  if ((rocking_ > 0).select(kInfinity, N).minCoeff(&i) >= 0) return tip(conditions, weight);
  Solution tipped = share_without(i, 1, conditions, weight);
  if (!(tipped.N >= 0).all()) return tip(conditions, weight);
  tipped.tipping = i % 2 == 0 ? Side::kRight : Side::kLeft;
  return tipped;
}

// The two wheels of one side carry all: the moment along that side is out of balance.
Reactions::Solution Reactions::tip(const Conditions& conditions, double weight) {
  struct Candidate {
    Side side;
    int a, b, balance;  // the wheels, and the row of the moment that gives their shares
  };
  const auto& [rows, right] = conditions;
  Solution best;
  best.by_moment.fill(Wheels::Zero());
  double best_share = -kInfinity;
  for (const Candidate& c :
       {Candidate{Side::kLeft, 0, 2, 0}, {Side::kRight, 1, 3, 0}, {Side::kFront, 0, 1, 1}, {Side::kRear, 2, 3, 1}}) {
    const Wheels& balance = rows[c.balance];
    const double N_a = (right[c.balance] - weight * balance[c.b]) / (balance[c.a] - balance[c.b]), N_b = weight - N_a;
    // One wheel bears all if the base tips over a corner, and both sides there qualify equally.
    const double least = std::min(N_a, N_b);
    // Between opposite sides, take the one towards which the other moment pulls.
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
  const auto set_balance = [&](int m, const Wheels& by_F_X, const Wheels& by_F_Y, const Wheels& by_M_Z) {
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
  set_balance(0, pitch_by_F_X_ * one, by_force_X_[1] * one, by_force_X_[2] * one);
  coupling.balance[0].dphi += G.dphi_dphi + friction_arm_ * G.platform_dphi[0];  // the bearings' share, of sum tau
  set_balance(1, by_force_Y_[0] * one, (by_force_Y_[1] + R_) * one, by_force_Y_[2] * one);
  if (rocks_) {
    set_balance(2, zero, R_ * rocking_, zero);
  } else {
    coupling.balance[2] = {zero, zero, zero};
  }
}

}  // namespace youbot_base_sim
