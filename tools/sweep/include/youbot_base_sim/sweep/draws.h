#pragma once

#include <cstdint>

namespace youbot_base_sim {

/// The arguments of a random number, so that it does not depend on the thread, the rank or the order of runs.
struct DrawPlace {
  std::uint64_t seed;
  std::uint64_t axis;
  std::uint64_t run;        ///< below 2^32
  std::uint64_t point = 0;  ///< of a grid, each with its own draws
};

/// Uniform in (0, 1), from kMinDraw to kMaxDraw.
double draw(const DrawPlace& place);

/// Sobol' points with nested uniform scrambling (Owen, 1995): of each axis, one of the first 2^m draws falls into each
/// of 2^m equal parts of (0, 1); several axes fill their space as evenly. `axis` is below kMaxSobolAxes.
double sobol_draw(const DrawPlace& place);
constexpr std::uint64_t kMaxSobolAxes = 3667;

/// A Latin hypercube: of each axis, one draw falls into each of `runs` equal parts of (0, 1).
double stratified_draw(const DrawPlace& place, std::uint64_t runs);

/// The place of `k` in a random permutation of 0 .. n-1 that is never stored.
std::uint64_t permuted(std::uint64_t k, std::uint64_t n, std::uint64_t seed, std::uint64_t axis);

/// The draws nearest to 0 and to 1.
constexpr double kMinDraw = 0x1p-53, kMaxDraw = 1 - 0x1p-53;

/// The distribution of numbers, by their quantiles.
struct Distribution {
  enum class Kind { kUniform, kLogUniform, kNormal };

  Kind kind = Kind::kUniform;
  double min = 0, max = 0;         ///< infinite for a normal distribution without truncation
  double mean = 0, deviation = 0;  ///< of a normal distribution, before truncation

  /// The number that a share `u` (0 to 1) of all does not exceed.
  double quantile(double u) const;
};

}  // namespace youbot_base_sim
