#pragma once

#include <random>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Four random numbers of mean 0 and standard deviation 1, as libstdc++ makes them, by Marsaglia's polar method.
inline Wheels normal_noise(std::mt19937_64& random) {
  Wheels noise;
  for (int i = 0; i < kWheels; i += 2) {
    double x, y, square;
    do {
      x = 2 * (static_cast<double>(random()) * 0x1p-64) - 1;
      y = 2 * (static_cast<double>(random()) * 0x1p-64) - 1;
      square = x * x + y * y;
    } while (square > 1 || square == 0);
    const double length = std::sqrt(-2 * logarithm(square) / square);
    noise[i] = y * length;
    noise[i + 1] = x * length;
  }
  return noise;
}

}  // namespace youbot_base_sim
