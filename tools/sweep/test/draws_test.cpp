// Draws depend on their place alone, are evenly distributed, and fill a Latin hypercube.

#include "youbot_base_sim/sweep/draws.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <vector>

namespace youbot_base_sim {
namespace {

TEST(Draw, IsAFunctionOfItsPlace) {
  const DrawPlace place{7, 2, 123456789};
  EXPECT_EQ(draw(place), draw(place));
  EXPECT_NE(draw(place), draw({8, 2, 123456789}));
  EXPECT_NE(draw(place), draw({7, 3, 123456789}));
  EXPECT_NE(draw(place), draw({7, 2, 123456790}));
}

/// The correlation of two lists of draws between 0 and 1.
double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - 0.5) * (b[k] - 0.5);
  return 12 * sum / static_cast<double>(a.size());
}

TEST(Draw, IsEvenlyDistributedAndIndependentOfItsNeighbours) {
  constexpr int kRuns = 100000, kParts = 100;
  std::vector<double> here, next_run, next_axis, next_seed;
  std::vector<double> counts(kParts);
  for (std::uint64_t run = 0; run < kRuns; ++run) {
    here.push_back(draw({1, 0, run}));
    next_run.push_back(draw({1, 0, run + 1}));
    next_axis.push_back(draw({1, 1, run}));
    next_seed.push_back(draw({2, 0, run}));
    ASSERT_GT(here.back(), 0);
    ASSERT_LT(here.back(), 1);
    ++counts[static_cast<std::size_t>(here.back() * kParts)];
  }
  double chi_squared = 0;
  for (const double count : counts) chi_squared += std::pow(count - kRuns / kParts, 2) / (kRuns / kParts);
  EXPECT_GT(chi_squared, 60);  // of 99 degrees of freedom: one in a thousand is beyond either
  EXPECT_LT(chi_squared, 149);
  for (const auto* other : {&next_run, &next_axis, &next_seed}) {
    EXPECT_LT(std::abs(correlation(here, *other)), 3.3 / std::sqrt(kRuns));
  }
}

TEST(Permuted, TakesEachNumberOnce) {
  for (const std::uint64_t n : {1u, 2u, 3u, 4u, 5u, 63u, 64u, 65u, 1000u, 4096u, 4097u}) {
    std::set<std::uint64_t> seen;
    for (std::uint64_t k = 0; k < n; ++k) seen.insert(permuted(k, n, 3, 1));
    EXPECT_EQ(seen.size(), n);
    EXPECT_EQ(*seen.rbegin(), n - 1);
  }
  int moved = 0, other = 0;
  for (std::uint64_t k = 0; k < 1000; ++k) {
    moved += permuted(k, 1000, 3, 1) != k;
    other += permuted(k, 1000, 3, 1) != permuted(k, 1000, 3, 2);
  }
  EXPECT_GT(moved, 990);
  EXPECT_GT(other, 990);
}

TEST(StratifiedDraw, FallsOnceIntoEachPart) {
  for (const std::uint64_t runs : {1u, 10u, 1000u}) {
    std::set<int> parts;
    for (std::uint64_t run = 0; run < runs; ++run) {
      parts.insert(static_cast<int>(stratified_draw({5, 2, run}, runs) * static_cast<double>(runs)));
    }
    EXPECT_EQ(parts.size(), runs);
    EXPECT_EQ(*parts.begin(), 0);
    EXPECT_EQ(*parts.rbegin(), static_cast<int>(runs) - 1);
  }
}

// Any elementary box of 2^-m in two axes has one of 2^m points: what makes Sobol' points a (0, m, 2)-net.
TEST(SobolDraw, FillsTwoAxesAsANet) {
  for (const std::uint64_t seed : {1u, 2u}) {
    for (int m = 0; m <= 10; ++m) {
      for (int cut = 0; cut <= m; ++cut) {
        std::set<std::pair<int, int>> boxes;
        for (std::uint64_t run = 0; run < 1u << m; ++run) {
          boxes.emplace(static_cast<int>(std::ldexp(sobol_draw({seed, 0, run}), cut)),
                        static_cast<int>(std::ldexp(sobol_draw({seed, 1, run}), m - cut)));
        }
        ASSERT_EQ(boxes.size(), 1u << m) << m << " " << cut;
      }
    }
  }
}

// The mean of a product over 8 axes, which is 1. Halton's and others' plain points correlate in pairs of later axes.
TEST(SobolDraw, IntegratesManyAxesWithALowErrorWithoutBias) {
  constexpr int kSeeds = 40, kAxes = 8;
  const auto mean = [](std::uint64_t seed, bool sobol) {
    double sum = 0;
    for (std::uint64_t run = 0; run < 256; ++run) {
      double product = 1;
      for (std::uint64_t axis = 0; axis < kAxes; ++axis) {
        const DrawPlace place{seed, axis, run};
        product *= 1 + 0.5 * ((sobol ? sobol_draw(place) : draw(place)) - 0.5);
      }
      sum += product;
    }
    return sum / 256 - 1;
  };
  double squares[2] = {}, bias = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    for (const bool sobol : {false, true}) squares[sobol] += std::pow(mean(seed, sobol), 2) / kSeeds;
    bias += mean(seed, true) / kSeeds;
  }
  EXPECT_LT(std::sqrt(squares[1]), 0.1 * std::sqrt(squares[0]));
  EXPECT_LT(std::abs(bias), 3.3 * std::sqrt(squares[1] / kSeeds));
}

TEST(SobolDraw, DiffersBySeedAndPointOfTheGrid) {
  int same = 0;
  for (std::uint64_t run = 0; run < 1000; ++run) {
    const double here = sobol_draw({7, 2, run});
    ASSERT_GT(here, 0);
    ASSERT_LT(here, 1);
    same += here == sobol_draw({8, 2, run}) || here == sobol_draw({7, 2, run, 1});
  }
  EXPECT_EQ(same, 0);
}

TEST(Distribution, HasItsQuantiles) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Distribution uniform{Distribution::Kind::kUniform, -1, 3};
  EXPECT_EQ(uniform.quantile(0.25), 0);
  const Distribution log_uniform{Distribution::Kind::kLogUniform, 0.01, 100};
  EXPECT_NEAR(log_uniform.quantile(0.5), 1, 1e-12);
  EXPECT_NEAR(log_uniform.quantile(0.75), 10, 1e-12);
  const Distribution normal{Distribution::Kind::kNormal, -kInfinity, kInfinity, 2, 0.5};
  EXPECT_NEAR(normal.quantile(0.5), 2, 1e-12);
  EXPECT_NEAR(normal.quantile(0.841344746068543), 2.5, 1e-12);
  const Distribution cut{Distribution::Kind::kNormal, 1.9, 2.4, 2, 0.5};
  EXPECT_NEAR(cut.quantile(kMinDraw), 1.9, 1e-12);
  EXPECT_NEAR(cut.quantile(kMaxDraw), 2.4, 1e-12);
  for (const Distribution& distribution : {uniform, log_uniform, normal, cut}) {
    for (const double share : {kMinDraw, kMaxDraw}) {
      EXPECT_GE(distribution.quantile(share), distribution.min);
      EXPECT_LE(distribution.quantile(share), distribution.max);
    }
  }
}

}  // namespace
}  // namespace youbot_base_sim
