#include "youbot_base_sim/physics/elementary.h"

#include <limits>

namespace youbot_base_sim {

namespace {

// Beyond it the turns of an angle have too many bits for `kQuarterTurn`, rad.
constexpr double kMaxAngle = 3e9;

// pi / 2 in Cody and Waite's parts: their first three have 22 bits, so that their products with whole numbers below
// 2^31 are exact.
constexpr double kQuarterTurn[] = {0x1.921fbp+0, 0x1.5110bp-22, 0x1.184698p-44, 0x1.3198a2e037073p-69};

// Sine and cosine of an angle that lies a number 0 .. 3 of quarter turns beyond one with these
SineAndCosine<double> after_turns(double number, double s, double c) {
  if (number == 1) return {c, -s};
  if (number == 2) return {-s, -c};
  if (number == 3) return {-c, s};
  return {s, c};
}

}  // namespace

SineAndCosine<double> sine_and_cosine(double x) {
  // So many turns of 2 pi in double precision are off by less than half an ulp of x.
  if (!(std::abs(x) < kMaxAngle)) x = std::remainder(x, 2 * M_PI);
  const double quarters = std::floor(x * (2 / M_PI) + 0.5);
  for (const double part : kQuarterTurn) x -= quarters * part;
  const auto [s, c] = small_sine_and_cosine(x);
  return after_turns(quarters - 4 * std::floor(0.25 * quarters), s, c);
}

SineAndCosine<FourAngles> sine_and_cosine(const FourAngles& angles) {
  SineAndCosine<FourAngles> result;
  const auto set = [&](int k, const SineAndCosine<double>& one) {
    result.sine[k] = one.sine;
    result.cosine[k] = one.cosine;
  };
  if (!(angles.abs() < kMaxAngle).all()) {
    for (int k = 0; k < 4; ++k) set(k, sine_and_cosine(angles[k]));
    return result;
  }
  FourAngles x = angles;
  const FourAngles quarters = (x * (2 / M_PI) + 0.5).floor(), number = quarters - 4 * (0.25 * quarters).floor();
  for (const double part : kQuarterTurn) x -= quarters * part;
  const auto [s, c] = small_sine_and_cosine(x);
  for (int k = 0; k < 4; ++k) set(k, after_turns(number[k], s[k], c[k]));
  return result;
}

double logarithm(double x) {
  // x = m 2^exponent with m near 1, and log m = 2 artanh z
  int exponent;
  double m = std::frexp(x, &exponent);
  if (m < M_SQRT1_2) {
    m *= 2;
    --exponent;
  }
  const double z = (m - 1) / (m + 1), q = z * z;
  double series = 0;
  for (int k = 21; k >= 3; k -= 2) series = (series + 1.0 / k) * q;
  constexpr double kLn2 = 0x1.62e42fefa38p-1, kLn2Rest = 0x1.ef35793c7673p-45;
  return exponent * kLn2 + (2 * z + (2 * z * series + exponent * kLn2Rest));
}

double root(double x, int n) {
  if (!(x > 0 && x <= std::numeric_limits<double>::max())) return x;
  // Newton's method falls to the root of a convex function from a power of two above it.
  int exponent;
  std::frexp(x, &exponent);
  double y = std::ldexp(1, exponent > 0 ? (exponent + n - 1) / n : exponent / n);
  for (;;) {
    double power = y;
    for (int k = 2; k < n; ++k) power *= y;
    const double next = y - (y - x / power) / n;
    if (!(next < y)) return y;
    y = next;
  }
}

}  // namespace youbot_base_sim
