#pragma once

#include <array>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Slip velocity of the contact points, m/s, or friction on them, N. Components 0 and 1 are X and Y in the platform's
/// frame; a third belongs to rotation on the spot: V_Z = a_m omega, F_Z = M_S / a_m.
template <int D>
struct alignas(kAlignment) ContactVector {
  std::array<Wheels, D> components;

  Wheels& operator[](int k) { return components[static_cast<std::size_t>(k)]; }
  const Wheels& operator[](int k) const { return components[static_cast<std::size_t>(k)]; }
};
template <int D>
ContactVector<D> operator+(const ContactVector<D>& a, const ContactVector<D>& b) {
  ContactVector<D> sum;
  for (int k = 0; k < D; ++k) sum[k] = a[k] + b[k];
  return sum;
}
template <class Factor, int D>
ContactVector<D> operator*(const Factor& factor, const ContactVector<D>& a) {
  ContactVector<D> product;
  for (int k = 0; k < D; ++k) product[k] = factor * a[k];
  return product;
}

/// -dF/dV_P, symmetric, N s/m.
template <int D>
class ContactStiffness {
 public:
  const Wheels& operator()(int k, int l) const { return entries_[index(k, l)]; }
  void set(int k, int l, const Wheels& value) { entries_[index(k, l)] = value; }

  /// Row k, which is also column k.
  ContactVector<D> row(int k) const {
    ContactVector<D> row;
    for (int l = 0; l < D; ++l) row[l] = (*this)(k, l);
    return row;
  }

 private:
  static constexpr std::size_t index(int k, int l) {
    return static_cast<std::size_t>(k < l ? l * (l + 1) / 2 + k : k * (k + 1) / 2 + l);
  }

  std::array<Wheels, D*(D + 1) / 2> entries_;  // the lower triangle, row by row
};

/// The answer of a friction law to a slip velocity V: friction is F = -slope V, against the slip and the same in all
/// directions, and the slope falls with the slip as d(slope)/dV = -slope scale^2 V.
struct SlipResistance {
  Wheels slope;    ///< N s/m
  Wheels scale;    ///< s/m
  Wheels regular;  ///< 1 - scale^2 |V|^2, computed without cancellation
};

/// Friction at the contacts by a law, which is regularised over slip speeds of about nu: it sees sqrt(nu^2 + |V|^2) in
/// place of |V| (section 5.2 of the paper). With D = 3, slip and spin share one limit, an ellipsoid (Howe and Cutkosky,
/// 1996).
///
/// A law is a class with the functions of CoulombLaw, free of allocation and branches.
template <class Law, int D>
class ContactFriction {
 public:
  using Vector = ContactVector<D>;
  using Stiffness = ContactStiffness<D>;

  ContactFriction(const Law& law, double nu) : law_(law), nu_(nu), nu_squared_(nu * nu) {}

  /// The resistance to the slip V under the limit f N, N.
  SlipResistance resistance(const Vector& V, const Wheels& limit) const {
    Wheels squares = nu_squared_ + V[0].square();
    for (int k = 1; k < D; ++k) squares += V[k].square();
    return law_.at(squares, nu_squared_, limit);
  }

  /// Friction at the slip V, of this resistance or under this limit, N.
  Vector force(const Vector& V, const SlipResistance& r) const {
    Vector F;
    for (int k = 0; k < D; ++k) F[k] = -r.slope * V[k];
    return F;
  }
  Vector force(const Vector& V, const Wheels& limit) const { return force(V, resistance(V, limit)); }

  /// Its stiffness; positive semidefinite unless the law's friction falls with the slip.
  Stiffness stiffness(const Vector& V, const Wheels& limit) const {
    const SlipResistance r = resistance(V, limit);
    Vector n;
    for (int k = 0; k < D; ++k) n[k] = V[k] * r.scale;
    Stiffness K;
    for (int k = 0; k < D; ++k) {
      // The squares of the other components rather than 1 - n_k^2: no cancellation in full slip.
      Wheels across = r.regular;
      for (int l = 0; l < D; ++l) {
        if (l != k) across += n[l].square();
      }
      K.set(k, k, r.slope * across);
      for (int l = 0; l < k; ++l) K.set(k, l, -r.slope * n[l] * n[k]);
    }
    return K;
  }

  /// The stiffness for a force F within the limit that is not yet that of V: from F / slope(V) = -V, by F and V (Chan,
  /// Golub and Mulet, SIAM J. Sci. Comput. 20(6), 1999). Newton's iterations then converge even from far beyond nu.
  Stiffness stiffness(const Vector& V, const Vector& F, const SlipResistance& r) const {
    Vector n;
    for (int k = 0; k < D; ++k) n[k] = V[k] * r.scale.square();
    Stiffness K;
    for (int k = 0; k < D; ++k) {
      for (int l = 0; l < k; ++l) K.set(k, l, 0.5 * (F[l] * n[k] + F[k] * n[l]));
      K.set(k, k, r.slope + F[k] * n[k]);
    }
    return K;
  }

  /// F, shortened to the largest friction under the limit f N.
  Vector bounded(const Vector& F, const Wheels& limit) const {
    const Wheels scale = (law_.largest(limit) * square(F).max(1e-300).sqrt().inverse()).min(1);
    return scale * F;
  }

  /// The slip at which friction is F, N, if that is less than the largest friction under the limit f N.
  Vector slip(const Vector& F, const Wheels& limit) const {
    const Wheels per_force = -nu_ * (law_.largest(limit).square() - square(F)).max(1e-300).sqrt().inverse();
    return per_force * F;
  }

  /// True if F is less than `share` of the `limit` f N (N), the friction of fast slips: then F belongs to one slip,
  /// which `slip` knows. A larger F belongs to two slips under a law whose friction falls with the slip.
  WheelMask grips(const Vector& F, const Wheels& limit, double share) const {
    return square(F) < (share * limit).square();
  }

  /// The regularization speed nu, m/s; infinite for a law that does not saturate, on which setting it has no effect.
  double regularization_speed() const { return Law::kLimited ? nu_ : kInfinity; }
  void set_regularization_speed(double nu) {
    nu_ = nu;
    nu_squared_ = nu * nu;
  }

 private:
  static Wheels square(const Vector& F) {
    Wheels squares = F[0].square();
    for (int k = 1; k < D; ++k) squares += F[k].square();
    return squares;
  }

  Law law_;
  double nu_, nu_squared_;
};

}  // namespace youbot_base_sim
