// Eight floats at a time, by the compilers' vector extension: the same answer with any instruction set.
#pragma once

#include <cstdint>
#include <cstring>

namespace lumihull::calib {

inline constexpr int kLanes = 8;
using Lanes = float __attribute__((vector_size(4 * kLanes)));
using IntLanes = std::int32_t __attribute__((vector_size(4 * kLanes)));

inline Lanes all(float v) { return Lanes{v, v, v, v, v, v, v, v}; }
inline IntLanes all_bits(std::int32_t v) { return IntLanes{v, v, v, v, v, v, v, v}; }
inline Lanes chosen(IntLanes where, Lanes yes, Lanes no) {
  return Lanes((IntLanes(yes) & where) | (IntLanes(no) & ~where));
}

/// exp(x) for x <= 0, to 2e-7 of its value; below -80: about e^-80.
inline Lanes exp_of_negative(Lanes x) {
  x = chosen(x < all(-80), all(-80), x);
  // 2^k 2^f, |f| <= 1/2: adding 1.5 · 2^23 rounds to an integer, which then stands in the lowest bits.
  const Lanes y = x * all(1.44269504f), shifted = y + all(12582912.0f);
  const IntLanes k = IntLanes(shifted) - IntLanes(all(12582912.0f));
  const Lanes f =
      (x - (shifted - all(12582912.0f)) * all(0.693359375f)) - (shifted - all(12582912.0f)) * all(-2.12194440e-4f);
  Lanes p = all(1.9875691500e-4f);  // Cephes' polynomial for e^f, |f| <= ln 2 / 2
  p = p * f + all(1.3981999507e-3f);
  p = p * f + all(8.3334519073e-3f);
  p = p * f + all(4.1665795894e-2f);
  p = p * f + all(1.6666665459e-1f);
  p = p * f + all(5.0000001201e-1f);
  p = p * f * f + f + all(1);
  return Lanes(IntLanes(p) + (k << 23));
}

/// 1 / sqrt(x), x > 0, to 3e-7 of its value.
inline Lanes inverse_root(Lanes x) {
  Lanes y = Lanes(all_bits(0x5f3759df) - (IntLanes(x) >> 1));  // halves the exponent; each step doubles the digits
  const Lanes half = all(0.5f) * x;
  for (int i = 0; i < 3; ++i) y = y * (all(1.5f) - half * y * y);
  return y;
}

/// The direction of (x, y) in -pi … pi, to 1e-4 rad (Abramowitz & Stegun 4.4.49, shortened).
inline Lanes angle_of(Lanes y, Lanes x) {
  const Lanes ax = Lanes(IntLanes(x) & 0x7fffffff), ay = Lanes(IntLanes(y) & 0x7fffffff);
  const IntLanes steep = ay > ax;
  const Lanes t = chosen(steep, ax, ay) / (chosen(steep, ay, ax) + all(1e-30f)), tt = t * t;
  Lanes a = t * (all(0.9998660f) +
                 tt * (all(-0.3302995f) + tt * (all(0.1801410f) + tt * (all(-0.0851330f) + tt * all(0.0208351f)))));
  a = chosen(steep, all(1.57079633f) - a, a);
  a = chosen(x < all(0), all(3.14159265f) - a, a);
  return chosen(y < all(0), -a, a);
}

/// The normal distribution function at z, given e = exp(-z² / 2), to 1e-7 (Abramowitz & Stegun 7.1.26).
inline Lanes normal_cdf(Lanes z, Lanes e) {
  const Lanes size = Lanes(IntLanes(z) & 0x7fffffff);
  const Lanes t = all(1) / (all(1) + all(0.3275911f * 0.70710678f) * size);
  Lanes p = all(1.061405429f);
  p = p * t - all(1.453152027f);
  p = p * t + all(1.421413741f);
  p = p * t - all(0.284496736f);
  p = p * t + all(0.254829592f);
  const Lanes tail = all(0.5f) * p * t * e;
  return chosen(z < all(0), tail, all(1) - tail);
}

}  // namespace lumihull::calib
