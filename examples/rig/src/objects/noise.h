#pragma once

// Random numbers and noise by hashing: a value depends on its coordinates alone, never on the order of evaluation, so
// that pictures are the same for any number of threads.

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

namespace lumihull::rig {

/// Finaliser of SplitMix64 (Steele, Lea & Flood 2014): a bijection of 64 bits that passes the usual test batteries.
inline std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}
inline std::uint64_t mix(std::uint64_t a, std::uint64_t b) { return mix(mix(a) ^ b); }

/// Uniform in [0, 1) from a hash.
inline float unit_float(std::uint64_t hash) { return float(hash >> 40) * 0x1p-24f; }
inline double unit_double(std::uint64_t hash) { return double(hash >> 11) * 0x1p-53; }

/// Mean 0, variance 1: the sum of the hash's four 16-bit parts (Irwin-Hall, excess kurtosis -0.3, bounded by 3.5).
/// Integer arithmetic only, so that noise is the same on every machine.
inline float gaussian(std::uint64_t hash) {
  const std::int64_t sum = std::int64_t(hash & 0xffff) + std::int64_t((hash >> 16) & 0xffff) +
                           std::int64_t((hash >> 32) & 0xffff) + std::int64_t(hash >> 48);
  return float(sum - 131070) * (1.7320508f / 65536.f);
}

/// Smooth noise, about -1 … 1, of feature size 1: random values on the integer lattice, quintic interpolation
/// (Perlin 2002).
inline float value_noise(const Eigen::Vector3f& p, std::uint64_t seed) {
  const Eigen::Vector3f cell(std::floor(p.x()), std::floor(p.y()), std::floor(p.z()));
  const Eigen::Vector3f t = p - cell;
  const auto fade = [](float x) { return x * x * x * (x * (x * 6 - 15) + 10); };
  const float fx = fade(t.x()), fy = fade(t.y()), fz = fade(t.z());
  const auto lattice = [&](int dx, int dy, int dz) {
    const auto x = std::uint64_t(std::int64_t(cell.x()) + dx) & 0x1fffff;
    const auto y = std::uint64_t(std::int64_t(cell.y()) + dy) & 0x1fffff;
    const auto z = std::uint64_t(std::int64_t(cell.z()) + dz) & 0x1fffff;
    return 2 * unit_float(mix((x << 42 | y << 21 | z) ^ seed * 0x9e3779b97f4a7c15ull)) - 1;
  };
  const auto along_x = [&](int dy, int dz) {
    const float a = lattice(0, dy, dz), b = lattice(1, dy, dz);
    return a + fx * (b - a);
  };
  const float y0 = along_x(0, 0) + fy * (along_x(1, 0) - along_x(0, 0));
  const float y1 = along_x(0, 1) + fy * (along_x(1, 1) - along_x(0, 1));
  return y0 + fz * (y1 - y0);
}

/// `octaves` of noise, each twice as fine and half as strong; about -1 … 1.
inline float fractal_noise(Eigen::Vector3f p, int octaves, std::uint64_t seed) {
  float sum = 0, weight = 0.5f;
  for (int i = 0; i < octaves; ++i, p *= 2.03f, weight *= 0.5f) sum += weight * value_noise(p, seed + std::uint64_t(i));
  return sum;
}

inline float smoothstep(float low, float high, float x) {
  const float t = std::fmin(1.f, std::fmax(0.f, (x - low) / (high - low)));
  return t * t * (3 - 2 * t);
}

/// Orthonormal frame around unit n: {t, b, n} (Duff et al. 2017).
inline Eigen::Matrix3f frame_around(const Eigen::Vector3f& n) {
  const float sign = std::copysign(1.f, n.z());
  const float a = -1 / (sign + n.z()), b = n.x() * n.y() * a;
  Eigen::Matrix3f m;
  m.col(0) = Eigen::Vector3f(1 + sign * n.x() * n.x() * a, sign * b, -sign * n.x());
  m.col(1) = Eigen::Vector3f(b, sign + n.y() * n.y() * a, -n.y());
  m.col(2) = n;
  return m;
}

}  // namespace lumihull::rig
