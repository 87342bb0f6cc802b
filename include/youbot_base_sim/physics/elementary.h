#pragma once

#include <Eigen/Dense>
#include <cmath>

#include "youbot_base_sim/export.h"

/// Elementary functions of the four operations and the square root, which IEEE 754 defines to the bit. Those of the C
/// library round differently from version to version and from processor to processor.
namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Sine and cosine of a number, or of all numbers of an array.
template <class Real>
struct SineAndCosine {
  Real sine, cosine;
};

/// Sine and cosine of x rad for |x| < 1.1, to 5e-16; the sine to 5e-16 |x|.
template <class Real>
SineAndCosine<Real> small_sine_and_cosine(const Real& x) {
  using std::sqrt;
  // The sine of half the angle by Taylor's polynomial
  const Real half = 0.5 * x, q = half * half;
  Real p = q * (1 / 6227020800.0) - 1 / 39916800.0;
  for (const double next : {1 / 362880.0, -1 / 5040.0, 1 / 120.0, -1 / 6.0}) p = p * q + next;
  const Real s = half + half * q * p, square = s * s;
  return {2 * s * sqrt(1 - square), 1 - 2 * square};
}

/// Sine and cosine of x rad, to 3e-16; beyond 3e9 rad to that and half an ulp of x.
SineAndCosine<double> sine_and_cosine(double x);
/// Four angles at once, with the same bits.
using FourAngles = Eigen::Array<double, 4, 1, Eigen::DontAlign>;
SineAndCosine<FourAngles> sine_and_cosine(const FourAngles& angles);

/// The natural logarithm of a finite x > 0, to 2 ulp.
double logarithm(double x);

/// The n-th root of x >= 0, to 2 ulp.
double root(double x, int n);

/// The vector v, rotated by psi rad about the third axis.
inline Eigen::Vector3d turned(const Eigen::Vector3d& v, double psi) {
  const auto [s, c] = sine_and_cosine(psi);
  return {c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]};
}

}  // namespace youbot_base_sim
