#include "youbot_base_sim/sweep/draws.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/random/sobol.hpp>
#include <cmath>

namespace youbot_base_sim {

namespace {

/// A mixing bijection of 64 bits: the finalizer of splitmix64 (Steele, Lea and Flood, 2014).
std::uint64_t scrambled(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
  return z ^ (z >> 31);
}

/// The k-th random number of a key.
std::uint64_t numbered(std::uint64_t key, std::uint64_t k) {
  constexpr std::uint64_t kGoldenRatio = 0x9E3779B97F4A7C15;  // of 2^64: its multiples are far apart
  return scrambled(key + (k + 1) * kGoldenRatio);
}

enum Purpose : std::uint64_t { kDraws, kPermutation, kScrambling };

std::uint64_t key_of(std::uint64_t seed, std::uint64_t axis, Purpose purpose) {
  return numbered(numbered(numbered(0, seed), axis), purpose);
}

/// The middle of one of 2^52 equal parts of (0, 1).
double share_of(std::uint64_t bits) { return (static_cast<double>(bits >> 12) + 0.5) * 0x1p-52; }

/// Flips each bit by a random number of all bits above it, and so permutes the halves of each part of (0, 1).
std::uint64_t nested_scrambled(std::uint64_t bits, std::uint64_t key) {
  std::uint64_t scrambled_bits = bits;
  for (int above = 0; above < 52; ++above) {
    const std::uint64_t part = above == 0 ? 0 : bits >> (64 - above);
    scrambled_bits ^= numbered(numbered(key, static_cast<std::uint64_t>(above)), part) >> 63 << (63 - above);
  }
  return scrambled_bits;
}

}  // namespace

double draw(const DrawPlace& place) {
  return share_of(numbered(key_of(place.seed, place.axis, kDraws), place.point << 32 | place.run));
}

double sobol_draw(const DrawPlace& place) {
  std::uint64_t bits = 0;  // Boost leaves out the first point, the origin
  if (place.run > 0) {
    boost::random::sobol engine(place.axis + 1);
    engine.seed(place.run - 1);
    for (std::uint64_t axis = 0; axis <= place.axis; ++axis) bits = engine();
  }
  return share_of(nested_scrambled(bits, numbered(key_of(place.seed, place.axis, kScrambling), place.point)));
}

double stratified_draw(const DrawPlace& place, std::uint64_t runs) {
  const auto part = static_cast<double>(permuted(place.run, runs, place.seed, place.axis));
  return std::min((part + draw(place)) / static_cast<double>(runs), kMaxDraw);
}

// A Feistel network permutes numbers of 2 * `half` bits; cycle walking (Black and Rogaway, 2002) returns to 0 .. n-1.
std::uint64_t permuted(std::uint64_t k, std::uint64_t n, std::uint64_t seed, std::uint64_t axis) {
  constexpr std::uint64_t kRounds = 8;
  int half = 1;
  while ((n - 1) >> (2 * half) != 0) ++half;
  const std::uint64_t mask = (std::uint64_t(1) << half) - 1, key = key_of(seed, axis, kPermutation);
  do {
    std::uint64_t left = k >> half, right = k & mask;
    for (std::uint64_t round = 0; round < kRounds; ++round) {
      const std::uint64_t next = left ^ (numbered(numbered(key, round), right) & mask);
      left = right;
      right = next;
    }
    k = left << half | right;
  } while (k >= n);
  return k;
}

double Distribution::quantile(double u) const {
  switch (kind) {
    case Kind::kUniform:
      return std::clamp(min + u * (max - min), min, max);
    case Kind::kLogUniform:
      return std::clamp(std::exp(std::log(min) + u * (std::log(max) - std::log(min))), min, max);
    case Kind::kNormal: {
      const boost::math::normal normal(mean, deviation);
      const double below = std::isfinite(min) ? cdf(normal, min) : 0, above = std::isfinite(max) ? cdf(normal, max) : 1;
      const double share = std::clamp(below + u * (above - below), kMinDraw, kMaxDraw);
      return std::clamp(boost::math::quantile(normal, share), min, max);
    }
  }
  return 0;
}

}  // namespace youbot_base_sim
