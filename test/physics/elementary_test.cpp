// Elementary functions against 50 digits of Boost.Multiprecision: over random arguments, and where it is hardest.

#include "youbot_base_sim/physics/elementary.h"

#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <limits>

#include "physics/random_states.h"

namespace youbot_base_sim {
namespace {

using Exact = boost::multiprecision::cpp_bin_float_50;
constexpr double kUlp = std::numeric_limits<double>::epsilon();  // at 1
constexpr double kInf = std::numeric_limits<double>::infinity();

double difference(double value, const Exact& exact) { return std::abs(static_cast<double>(value - exact)); }

/// A number from 10^min to 10^max, all decades alike.
double of_any_size(Random& random, double min, double max) { return std::pow(10, random.uniform(min, max)); }

// At 1.1 rad the polynomial leaves out 1e-16 of the half angle's sine, which is 2e-16 of the cosine; rounding adds as
// much.
TEST(SmallSineAndCosine, ErrBy5em16AtMost) {
  Random random(1);
  for (int k = 0; k < 5000; ++k) {
    const double x = k % 2 ? random.uniform(-1.1, 1.1) : of_any_size(random, -20, 0);
    const auto [s, c] = small_sine_and_cosine(x);
    ASSERT_LT(difference(s, sin(Exact(x))), 5e-16) << x;
    ASSERT_LT(difference(c, cos(Exact(x))), 5e-16) << x;
    ASSERT_LT(difference(s, sin(Exact(x))), 5e-16 * std::abs(x)) << x;
  }
}

TEST(SmallSineAndCosine, AreTheSameForFourAtOnce) {
  Random random(2);
  for (int k = 0; k < 5000; ++k) {
    const Wheels x = random.wheels(-1.1, 1.1);
    const auto [s, c] = small_sine_and_cosine(x);
    for (int i = 0; i < kWheels; ++i) {
      ASSERT_EQ(s[i], small_sine_and_cosine(x[i]).sine);
      ASSERT_EQ(c[i], small_sine_and_cosine(x[i]).cosine);
    }
  }
}

/// The larger error of both.
double error_of_sine_and_cosine(double x) {
  const auto [s, c] = sine_and_cosine(x);
  return std::max(difference(s, sin(Exact(x))), difference(c, cos(Exact(x))));
}

TEST(SineAndCosine, ErrBy3em16AtMost) {
  Random random(3);
  for (int k = 0; k < 10000; ++k) {
    const double x = (k % 2 ? 1 : -1) * of_any_size(random, -10, std::log10(3e9));
    ASSERT_LT(error_of_sine_and_cosine(x), 3e-16) << x;
  }
}

// There the reduced angle has the fewest digits, and halfway between two of them it is largest.
TEST(SineAndCosine, ErrNoMoreNextToMultiplesOfAQuarterOfPi) {
  const Exact pi = boost::math::constants::pi<Exact>();
  Random random(4);
  for (int k = 0; k < 2000; ++k) {
    const double multiple = k < 500 ? k : std::floor(of_any_size(random, 2, std::log10(3e9 / 0.8)));
    const double nearest = static_cast<double>(multiple * pi / 4);
    for (const double x : {nearest, std::nextafter(nearest, 0), std::nextafter(nearest, kInf), -nearest}) {
      ASSERT_LT(error_of_sine_and_cosine(x), 3e-16) << x;
    }
  }
}

TEST(SineAndCosine, ErrByHalfAnUlpOfTheAngleBeyond) {
  Random random(5);
  for (int k = 0; k < 1000; ++k) {
    const double x = of_any_size(random, std::log10(3e9), 15);
    ASSERT_LT(error_of_sine_and_cosine(x), 3e-16 + 0.5 * (std::nextafter(x, kInf) - x)) << x;
  }
  for (const double x : {1e100, std::numeric_limits<double>::max()}) {
    const auto [s, c] = sine_and_cosine(x);
    EXPECT_NEAR(s * s + c * c, 1, 4 * kUlp);
  }
}

TEST(SineAndCosine, AreTheSameForFourAtOnce) {
  Random random(8);
  for (int k = 0; k < 5000; ++k) {
    Wheels x;
    for (int i = 0; i < kWheels; ++i) x[i] = (random.uniform(-1, 1) < 0 ? -1 : 1) * of_any_size(random, -10, 9.6);
    const auto [s, c] = sine_and_cosine(x);
    for (int i = 0; i < kWheels; ++i) {
      ASSERT_EQ(s[i], sine_and_cosine(x[i]).sine) << x[i];
      ASSERT_EQ(c[i], sine_and_cosine(x[i]).cosine) << x[i];
    }
  }
}

TEST(SineAndCosine, AreExactAtZeroAndNotANumberWithoutAngle) {
  EXPECT_EQ(sine_and_cosine(0).sine, 0);
  EXPECT_EQ(sine_and_cosine(0).cosine, 1);
  for (const double x : {kInf, -kInf, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_TRUE(std::isnan(sine_and_cosine(x).sine)) << x;
    EXPECT_TRUE(std::isnan(sine_and_cosine(x).cosine)) << x;
  }
}

TEST(Logarithm, ErrsBy2UlpsAtMost) {
  Random random(6);
  const auto expect_near = [](double x) {
    const Exact exact = log(Exact(x));
    EXPECT_LE(difference(logarithm(x), exact), 2 * kUlp * std::abs(static_cast<double>(exact))) << x;
  };
  for (int k = 0; k < 3000; ++k) {
    expect_near(of_any_size(random, -320, 308));
    expect_near(random.uniform(0.5, 2));
    expect_near(1 + (k % 2 ? 1 : -0.5) * of_any_size(random, -16, -1));
  }
  for (const double x :
       {0.5, M_SQRT1_2, std::nextafter(M_SQRT1_2, 0), std::nextafter(1.0, 0), std::nextafter(1.0, 2)}) {
    expect_near(x);
  }
  EXPECT_EQ(logarithm(1), 0);
}

TEST(Root, ErrsBy2UlpsAtMost) {
  Random random(7);
  for (int k = 0; k < 3000; ++k) {
    const double x = of_any_size(random, -300, 300);
    const int n = 2 + k % 7;
    const Exact exact = pow(Exact(x), Exact(1) / n);
    ASSERT_LE(difference(root(x, n), exact), 2 * kUlp * static_cast<double>(exact)) << x << " " << n;
  }
  for (const double x : {0.0, kInf}) EXPECT_EQ(root(x, 5), x);
  for (const double x : {1.0, 32.0, 1 / 32.0}) EXPECT_EQ(root(x, 5), std::pow(x, 0.2));
}

}  // namespace
}  // namespace youbot_base_sim
