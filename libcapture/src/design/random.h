#pragma once

// Random numbers that are the same everywhere: the standard's distributions are not.

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace lumihull::capture::design {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// In [0, 1), 53 bits.
  double uniform() { return double(engine_() >> 11) * 0x1p-53; }

  /// Mean 0, variance 1 (Box & Muller 1958).
  double normal() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace lumihull::capture::design
